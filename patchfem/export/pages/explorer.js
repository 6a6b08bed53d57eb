// Draws the cases of a sweep from the page's data: lines with error bands, a map of two keys, or a cloud of points.
//
// data.keys:     [{name, label, unit, log, values: [...] per case, texts: [...] per case, words}]
// data.measures: [{name, label, unit, means, values: [...], errors: [...], over: [...] whether a case misses its
//                tolerance, 1 or 0}]   already in the unit shown
// data.outcome:  [...] per case; data.settled: outcomes that count as an answer; data.links: [...] per case or null;
// data.whole: whether the cases are all of the sweep
"use strict";
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const count = data.outcome.length;
  const at = (id) => document.getElementById(id);
  const {ink, colours, within, named, figure, legend, bar, put} = pictures;
  const bad = (i) => !data.settled.includes(data.outcome[i]);
  const of = (name) => data.measures.find((one) => one.name === name);
  const log = () => at("log").checked;           // whether the axis of the values is logarithmic
  const values = () => ({y_axis_type: log() ? "log" : "linear"});
  const DECADES = 2;                             // of values, from which their axis is logarithmic by itself
  const key = (name) => data.keys.find((one) => one.name === name);

  function option(select, value, text) {
    const one = document.createElement("option");
    one.value = value; one.textContent = text;
    select.append(one);
  }

  function fill() {
    data.measures.forEach((one) => option(at("measure"), one.name, one.label));
    data.keys.forEach((one) => option(at("along"), one.name, one.label));
    if (data.measures.some((one) => one.name === data.first)) at("measure").value = data.first;
    at("along").value = data.along;
    ["measure", "along", "beside", "shown", "log", "log-along"].forEach((id) => at(id).addEventListener("change", () => refresh(id)));
    scaled();
    beside();
  }

  function beside() {                            // the second key: those that are not along the axis
    const select = at("beside"), old = select.value, x = key(at("along").value);
    at("log-along").checked = x.log;
    at("log-along").disabled = Boolean(x.words) || !x.values.some((v) => v > 0);
    select.replaceChildren();
    option(select, "", "none");
    data.keys.filter((one) => one.name !== at("along").value).forEach((one) => option(select, one.name, one.label));
    select.value = [...select.options].some((o) => o.value === old) ? old : "";
    if (!old && select.options.length > 1 && data.grid) select.value = select.options[1].value;
    at("shown").disabled = !data.grid || !select.value;
    others();
  }

  function others() {                            // the value held of every other key of a grid
    const place = at("held"), old = {};
    place.querySelectorAll("select").forEach((one) => { old[one.dataset.key] = one.value; });
    place.replaceChildren();
    if (!data.grid) return;
    data.keys.filter((one) => ![at("along").value, at("beside").value].includes(one.name)).forEach((one) => {
      const label = document.createElement("label"), select = document.createElement("select");
      label.append(one.label, select);
      select.dataset.key = one.name;
      const seen = new Map();
      one.values.forEach((v, i) => { if (!seen.has(v)) seen.set(v, one.texts[i]); });
      [...seen].sort((a, b) => a[0] - b[0]).forEach(([v, text]) => option(select, v, text));
      if (old[one.name] !== undefined) select.value = old[one.name];
      else select.selectedIndex = select.options.length >> 1;      // of the ends, one is often stuck, one runs away
      select.addEventListener("change", draw);
      place.append(label);
    });
  }

  function scaled() {                            // the tick box of the values, as they ask for it by themselves
    const found = of(at("measure").value).values.filter((v) => v !== null);
    at("log").checked = found.length > 0 && Math.min(...found) > 0 &&
      Math.max(...found) > 10 ** DECADES * Math.min(...found);
  }

  function refresh(id) {
    if (id === "measure") scaled();
    if (id === "along") beside();
    if (id === "beside") { at("shown").disabled = !data.grid || !at("beside").value; others(); }
    draw();
  }

  function chosen() {                            // numbers of the cases that agree with every held value
    const held = [...at("held").querySelectorAll("select")].map((one) => [key(one.dataset.key), Number(one.value)]);
    const out = [];
    for (let i = 0; i < count; i++) if (held.every(([one, v]) => one.values[i] === v)) out.push(i);
    return out;
  }

  function worded(axis, one) {                   // ticks with the words of a key whose values are words
    if (!one.words) return;
    axis.ticker = new Bokeh.FixedTicker({ticks: one.words.map(([v]) => v)});
    axis.major_label_overrides = new Map(one.words);
  }

  function source(cases, m, more) {
    const column = {case: cases, value: cases.map((i) => m.values[i]),
      said: cases.map((i) => `${within(m.values[i], m.errors[i], m.least)} ${m.unit}`),
      outcome: cases.map((i) => data.outcome[i]), marker: cases.map((i) => bad(i) ? "x" : "circle"), ...more};
    data.keys.forEach((one, k) => { column[`key${k}`] = cases.map((i) => one.texts[i]); });
    const made = new Bokeh.ColumnDataSource({data: column});
    made.selected.properties.indices.change.connect(() => {
      const hit = made.selected.indices[0];
      if (hit !== undefined && data.links) window.open(data.links[column.case[hit]], "_blank", "noopener");
    });
    return made;
  }

  function hover(fig, m, renderers) {
    const rows = [[m.label, "@said"], ...data.keys.map((one, k) => [one.label, `@key${k}`]), ["outcome", "@outcome"]];
    fig.add_tools(new Bokeh.HoverTool({tooltips: rows, renderers}));
  }

  function spread(cases, m) {                    // ends of the bars; on a logarithmic axis none goes below all values
    const least = Math.min(...m.values.filter((v) => v > 0)) / 10;
    const end = (i, sign) => m.values[i] === null ? NaN : Math.max(m.values[i] + sign * (m.errors[i] ?? 0), m.minimum ?? -Infinity);
    const low = cases.map((i) => log() ? Math.max(end(i, -1), Math.min(least, m.values[i])) : end(i, -1));
    return {low, high: cases.map((i) => end(i, 1))};
  }

  function curve(fig, cases, x, m, colour, label) {
    cases.sort((a, b) => x.values[a] - x.values[b]);
    const xs = cases.map((i) => x.values[i]);
    const made = source(cases, m, {x: xs, y: cases.map((i) => m.values[i] ?? NaN), ...spread(cases, m),
      fill: cases.map((i) => m.over[i] ? ink("--paper") : colour), edge: cases.map((i) => bad(i) ? ink("--warm") : colour), stroke: cases.map((i) => bad(i) ? 2.5 : m.over[i] ? 1.8 : 1)});
    fig.varea({field: "x"}, {field: "low"}, {field: "high"}, {source: made, fill_color: colour, fill_alpha: 0.22});
    const named = label ? {legend_label: label} : {};
    fig.line({field: "x"}, {field: "y"}, {source: made, line_color: colour, line_width: 2, ...named});
    return fig.scatter({field: "x"}, {field: "y"}, {source: made, size: 8, fill_color: {field: "fill"},
      line_color: {field: "edge"}, line_width: {field: "stroke"}, marker: {field: "marker"}, ...named});
  }

  function unsettled(fig, cases, x) {            // stretches of the axis on which no case of the picture settles
    const xs = [...new Set(cases.map((i) => x.values[i]))].sort((a, b) => a - b);
    const half = (a, b) => x.log && a > 0 ? Math.sqrt(a * b) : (a + b) / 2;
    xs.forEach((v, k) => {
      if (!cases.filter((i) => x.values[i] === v).every(bad)) return;
      fig.add_layout(new Bokeh.BoxAnnotation({       // a side that is left out is that of the frame
        ...(k ? {left: half(xs[k - 1], v)} : {}), ...(k < xs.length - 1 ? {right: half(v, xs[k + 1])} : {}),
        fill_color: ink("--warm"), fill_alpha: 0.12, line_color: null}));
    });
  }

  function lines(cases, x, beside, m) {
    const fig = figure(x, named(m), values()), groups = new Map();
    worded(fig.xaxis, x);
    cases.forEach((i) => {
      const v = beside ? beside.values[i] : 0;
      if (!groups.has(v)) groups.set(v, []);
      groups.get(v).push(i);
    });
    unsettled(fig, cases, x);
    const cycle = colours(), dots = [], sizes = [...groups.keys()].sort((a, b) => a - b);
    const many = beside && !beside.words && sizes.length > cycle.length;  // a scale of colours in place of their names
    const level = (v) => beside.log && sizes[0] > 0 ? Math.log(v) : v;
    const scale = Bokeh.Palettes.cividis(256);
    sizes.forEach((v, k) => {
      const group = groups.get(v);
      const colour = many ? scale[Math.round(255 * (level(v) - level(sizes[0])) / (level(sizes.at(-1)) - level(sizes[0])))] : cycle[k % cycle.length];
      dots.push(curve(fig, group, x, m, colour, beside && !many ? `${beside.label} ${beside.texts[group[0]]}` : ""));
    });
    if (many) {
      const mapper = new Bokeh[beside.log && sizes[0] > 0 ? "LogColorMapper" : "LinearColorMapper"]({
        palette: scale, low: sizes[0], high: sizes.at(-1)});
      bar(fig, mapper, named(beside));
    }
    hover(fig, m, dots);
    if (beside && !many) legend(fig);
    return fig;
  }

  function edges(values, log) {                  // ends of the cells around sorted values, halfway to the neighbours
    const t = values.map((v) => log ? Math.log(v) : v), n = t.length, out = [];
    for (let k = 0; k <= n; k++) {
      out.push(n === 1 ? t[0] + k - 0.5 : k === 0 ? 1.5 * t[0] - 0.5 * t[1] :
        k === n ? 1.5 * t[n - 1] - 0.5 * t[n - 2] : (t[k - 1] + t[k]) / 2);
    }
    return log ? out.map(Math.exp) : out;
  }

  function map(cases, x, y, m) {
    const fig = figure(x, named(y), {y_axis_type: y.log ? "log" : "linear"});
    worded(fig.xaxis, x);
    worded(fig.yaxis, y);
    const [xs, ys] = [x, y].map((one) => [...new Set(cases.map((i) => one.values[i]))].sort((a, b) => a - b));
    const [ex, ey] = [edges(xs, x.log), edges(ys, y.log)];
    const place = (of, all, one) => cases.map((i) => all[of.indexOf(one.values[i])]);
    const found = cases.map((i) => m.values[i]).filter((v) => v !== null);
    const low = Math.min(...found), high = Math.max(...found);
    const mapper = new Bokeh[log() && low > 0 ? "LogColorMapper" : "LinearColorMapper"]({
      palette: Bokeh.Palettes.cividis(256), low, high: high > low ? high : low + 1, nan_color: "rgba(128,128,128,0.25)"});
    const made = source(cases, m, {left: place(xs, ex.slice(0, -1), x), right: place(xs, ex.slice(1), x),
      bottom: place(ys, ey.slice(0, -1), y), top: place(ys, ey.slice(1), y),
      hatch: cases.map((i) => bad(i) ? "right_diagonal_line" : m.over[i] ? "dot" : "blank")});
    const cells = fig.quad({field: "left"}, {field: "right"}, {field: "bottom"}, {field: "top"}, {source: made,
      fill_color: {field: "value", transform: mapper}, line_color: ink("--paper"), line_width: 0.5,
      hatch_pattern: {field: "hatch"}, hatch_color: ink("--warm"), hatch_weight: 1.5, hatch_scale: 10});
    bar(fig, mapper, named(m));
    hover(fig, m, [cells]);
    return fig;
  }

  function cloud(cases, x, beside, m) {
    const fig = figure(x, named(m), values());
    worded(fig.xaxis, x);
    const made = source(cases, m, {x: cases.map((i) => x.values[i]), y: cases.map((i) => m.values[i] ?? NaN),
      colour: cases.map((i) => bad(i) ? ink("--warm") : ink("--accent")),
      shade: cases.map((i) => beside ? beside.values[i] : 0), stroke: cases.map((i) => bad(i) ? 2 : beside ? 0.5 : 1),
      filled: cases.map((i) => m.over[i] ? 0 : 0.75), ...spread(cases, m)});
    fig.segment({field: "x"}, {field: "low"}, {field: "x"}, {field: "high"}, {source: made, line_color: ink("--soft")});
    let fill = {field: "colour"};
    if (beside) {
      const v = cases.map((i) => beside.values[i]), low = Math.min(...v), high = Math.max(...v);
      const mapper = new Bokeh[beside.log ? "LogColorMapper" : "LinearColorMapper"]({
        palette: Bokeh.Palettes.cividis(256), low, high: high > low ? high : low + 1});
      fill = {field: "shade", transform: mapper};
      bar(fig, mapper, named(beside));
    }
    const dots = fig.scatter({field: "x"}, {field: "y"}, {source: made, size: count > 2000 ? 4 : 7, fill_color: fill,
      line_color: {field: "colour"}, line_width: {field: "stroke"}, fill_alpha: {field: "filled"}, marker: {field: "marker"}});
    hover(fig, m, [dots]);
    return fig;
  }

  function told(cases, x, beside, m, mapped) {           // the picture in words, for those who hear the page
    const found = cases.filter((i) => m.values[i] !== null);
    if (!found.length) return `No value in these ${cases.length} cases.`;
    const lowest = found.reduce((a, b) => m.values[b] < m.values[a] ? b : a);
    const highest = found.reduce((a, b) => m.values[b] > m.values[a] ? b : a);
    const where = (i) => `${x.label} ${x.texts[i]}` + (beside ? `, ${beside.label} ${beside.texts[i]}` : "");
    const off = cases.filter(bad).length, open = cases.filter((i) => m.over[i]).length;
    const value = (i) => `${within(m.values[i], m.errors[i], m.least)} ${m.unit}`.trim();
    const some = `${cases.length} ${data.whole ? "" : "drawn "}cases`;
    return `Against ${x.label}: lowest value ${value(lowest)} at ${where(lowest)}; highest value ` +
      `${value(highest)} at ${where(highest)}.` + (off ? ` ${off} of ${some} did not ` +
      `settle (${mapped ? "hatched" : "crosses"}).` : "") + (open ? ` ${open} of ${some} miss the tolerance ` +
      `(${mapped ? "dotted" : "hollow"}).` : "");
  }

  function draw() {
    const every = chosen(), beside = key(at("beside").value);
    const x = {...key(at("along").value), log: at("log-along").checked};
    const m = of(at("measure").value);
    const mapped = data.grid && beside && at("shown").value === "map";
    const axes = [x, ...(beside && (mapped || !data.grid) ? [beside] : [])].filter((one) => one.log);
    // a logarithmic axis has no place for 0
    const cases = every.filter((i) => axes.every((one) => one.values[i] > 0) &&
      (mapped || !log() || m.values[i] === null || m.values[i] > 0));
    const make = () => !data.grid ? cloud(cases, x, beside, m) :
      mapped ? map(cases, x, beside, m) : lines(cases, x, beside, m);
    const away = every.filter((i) => !cases.includes(i));
    const value = (i) => `${within(m.values[i], m.errors[i], m.least)} ${m.unit}`.trim();
    const zero = !away.length ? "" : ` Not drawn on a logarithmic axis: ${away.length === 1 ?
      `the case at ${x.label} ${x.texts[away[0]]}, ${value(away[0])}` : `${away.length} cases with values of 0 or below`}.`;
    const words = told(cases, x, beside, m, mapped) + zero;
    at("means").textContent = `${m.means ? `${m.means[0].toUpperCase()}${m.means.slice(1)}. ` : ""}${words}`;
    at("chart").setAttribute("aria-label", `${m.label}: ${words}`);
    put(make, at("chart"));
  }

  fill();
  pictures.themed(draw);
})();
