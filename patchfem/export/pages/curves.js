// Draws the charts of a page, each in the element of its anchor: hover values, zoom, a legend whose entries hide lines.
//
// data.charts: [{anchor, title, x, y: {label, unit, log, range}, marks: [{kind, colour, name, ...numbers}], frame}]
// frame: [width, height] in pixels where both axes share a scale.
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const {ink, named, figure, legend, bar, put, themed} = pictures;
  const whole = (values) => values.map((v) => v ?? NaN);
  const shade = (name) => name.startsWith("#") ? name : ink(`--${name}`);
  const label = (mark) => mark.name ? {legend_label: mark.name} : {};

  const kinds = {
    line(fig, mark) {
      return fig.line({field: "x"}, {field: "y"}, {source: column(mark, {}), line_color: shade(mark.colour),
        line_width: mark.width ?? 1.6, line_alpha: mark.alpha ?? 1, line_dash: mark.dash ?? "solid", ...label(mark)});
    },
    dots(fig, mark) {
      const errors = mark.errors ?? mark.x.map(() => 0), colour = shade(mark.colour);
      const source = column(mark, {low: mark.y.map((v, k) => Math.max(v - errors[k], mark.floor ?? -Infinity)), high: mark.y.map((v, k) => v + errors[k])});
      fig.segment({field: "x"}, {field: "low"}, {field: "x"}, {field: "high"}, {source, line_color: colour});
      return fig.scatter({field: "x"}, {field: "y"}, {source, size: 9, marker: mark.shape ?? "circle",
        fill_color: colour, fill_alpha: 0.6, line_color: colour, ...label(mark)});
    },
    band(fig, mark) {
      const source = new Bokeh.ColumnDataSource({data: {x: mark.x, low: whole(mark.low), high: whole(mark.high)}});
      fig.varea({field: "x"}, {field: "low"}, {field: "high"}, {source, fill_color: shade(mark.colour),
        fill_alpha: 0.22});
    },
    span(fig, mark) {
      fig.add_layout(new Bokeh.BoxAnnotation({left: mark.left, right: mark.right, fill_color: shade(mark.colour),
        fill_alpha: 0.15, line_color: null}));
    },
    rule(fig, mark) {
      fig.add_layout(new Bokeh.Span({location: mark.x, dimension: "height", line_color: shade(mark.colour),
        line_dash: "dotdash"}));
      if (mark.name) fig.line([mark.x, mark.x], [NaN, NaN], {line_color: shade(mark.colour), line_dash: "dotdash", ...label(mark)});
    },
    arrow(fig, mark) {
      const [a, b] = mark.x, [c, d] = mark.y, at = (s, p, q) => p + s * (q - p);
      const up = (s) => mark.floor ? c * (d / c) ** s : at(s, c, d);    // a floor: of a logarithmic axis
      fig.add_layout(new Bokeh.Arrow({x_start: at(0.45, a, b), x_end: at(0.58, a, b), y_start: up(0.45),
        y_end: up(0.58), line_color: null, end: new Bokeh.NormalHead({size: 9, fill_color: shade(mark.colour),
          line_color: null})}));
      return kinds.line(fig, mark);
    },
    cells(fig, mark) {                           // a grid of cells over the lines x and y, coloured by their value
      const low = Math.min, high = Math.max, box = {left: [], right: [], bottom: [], top: [], value: []};
      mark.value.forEach((row, i) => row.forEach((v, j) => {
        box.left.push(mark.x[i]); box.right.push(mark.x[i + 1]);
        box.bottom.push(low(mark.y[j], mark.y[j + 1])); box.top.push(high(mark.y[j], mark.y[j + 1])); box.value.push(v);
      }));
      const transform = new Bokeh.LinearColorMapper({palette: Bokeh.Palettes.viridis(256), low: 0, high: mark.top});
      const fill = {field: "value", transform};
      if (!fig.coloured) bar(fig, transform, mark.unit);
      fig.coloured = true;
      const cells = fig.quad({field: "left"}, {field: "right"}, {field: "bottom"}, {field: "top"},
        {source: new Bokeh.ColumnDataSource({data: box}), fill_color: fill, line_color: fill, line_width: 1});
      fig.add_tools(new Bokeh.HoverTool({renderers: [cells], formatters: {"@value": "printf"},
        tooltips: [[mark.name || "stress", `@value{%.4g} ${mark.unit}`]]}));
    },
  };

  function column(mark, more) {
    return new Bokeh.ColumnDataSource({data: {x: whole(mark.x), y: whole(mark.y),
      name: mark.x.map(() => mark.name || ""), ...more}});
  }

  const BESIDE = 215, AROUND = 85;               // pixels that axis, scale of colours and tools take beside a frame
  function framed([wide, tall], place) {         // a frame as large as its place lets it be
    const share = Math.min(1, (place.clientWidth - BESIDE) / wide);
    const high = Math.round(share * tall);
    place.style.height = `${high + AROUND}px`;
    return {sizing_mode: "fixed", width: place.clientWidth, height: high + AROUND, frame_width: Math.round(share * wide), frame_height: high};
  }

  function made(chart, place) {
    const range = (axis) => axis.range ? new Bokeh.Range1d({start: axis.range[0], end: axis.range[1]}) : undefined;
    const ranges = {x_range: range(chart.x), y_range: range(chart.y)};
    Object.keys(ranges).forEach((name) => ranges[name] === undefined && delete ranges[name]);
    const fig = figure(chart.x, named(chart.y), {y_axis_type: chart.y.log ? "log" : "linear",
      height: chart.height ?? 330, tools: "pan,box_zoom,wheel_zoom,reset,save", ...ranges,
      ...(chart.frame ? framed(chart.frame, place) : {})});
    if (chart.frame)                             // few numbers fit under a narrow frame
      fig.xaxis.ticker = new Bokeh.BasicTicker({desired_num_ticks: Math.max(1, Math.min(6, Math.floor(fig.frame_width / 50)))});
    const shown = chart.marks.map((mark) => kinds[mark.kind](fig, mark)).filter((one) => one);
    const rows = [[named(chart.x), "@x{%.7g}"], [named(chart.y), "@y{%.7g}"]];
    const several = new Set(chart.marks.map((mark) => mark.name)).size > 1;
    if (shown.length) {
      fig.add_tools(new Bokeh.HoverTool({renderers: shown, line_policy: "nearest", attachment: "right",
        formatters: {"@x": "printf", "@y": "printf"}, tooltips: several ? [["", "@name"], ...rows] : rows}));
    }
    fig.title.text = chart.title;
    Object.assign(fig.title, {text_color: ink("--ink"), text_font_style: "normal", text_font_size: "13px"});
    if (chart.marks.some((mark) => mark.name)) legend(fig);
    return fig;
  }

  themed(() => data.charts.forEach((chart) => {
    const place = document.getElementById(chart.anchor);
    put(() => made(chart, place), place);
  }));
})();
