// Draws the charts of a page: lines over a common axis, one set per chart, with hover values, zoom and a legend.
//
// data.charts: [{anchor, x: {label, unit, log}, y: {label, unit, log}, lines: [{name, x: [...], y: [...], dots}]}]
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const {colours, named, figure, legend, put} = pictures;

  function draw(chart) {
    const fig = figure(chart.x, named(chart.y), {y_axis_type: chart.y.log ? "log" : "linear"}), cycle = colours();
    const shown = chart.lines.map((one, k) => {
      const source = new Bokeh.ColumnDataSource({data: {x: one.x.map((v) => v ?? NaN), y: one.y.map((v) => v ?? NaN),
        name: one.x.map(() => one.name)}});
      const style = {source, line_color: cycle[k % cycle.length], legend_label: one.name};
      const line = fig.line({field: "x"}, {field: "y"}, {...style, line_width: 1.6});
      return one.dots ? fig.scatter({field: "x"}, {field: "y"}, {...style, size: 7, fill_color: cycle[k % cycle.length]})
        : line;
    });
    fig.add_tools(new Bokeh.HoverTool({renderers: shown, line_policy: "nearest", formatters: {"@x": "printf", "@y": "printf"},
      tooltips: [["run", "@name"], [named(chart.x), "@x{%.7g}"], [named(chart.y), "@y{%.7g}"]]}));
    if (chart.lines.length > 1) legend(fig); else fig.legend.visible = false;
    put(fig, document.getElementById(chart.anchor));
  }

  const all = () => data.charts.forEach(draw);
  all();
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", all);
})();
