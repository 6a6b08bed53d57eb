// What every picture of a page shares: colours of the page, numbers as people read them, an empty figure.
"use strict";
const pictures = (() => {
  const root = document.documentElement;
  const ink = (name) => getComputedStyle(root).getPropertyValue(name).trim();
  const colours = () => [ink("--accent"), ink("--warm"), "#2f9e63", "#8e5fc2", "#b08a12", "#c14a86", "#3aa6b9", "#7d7d7d"];
  const number = (v) => v === null ? "–" : Number(v.toPrecision(7)).toString();
  const within = (v, e, least) => {              // a value with its error, as `formatting.round_to_error` writes it
    if (v === null) return "no value";
    const size = Math.abs(v);
    if (size <= least) return e !== null && e >= least && e > 0 ? `0 ± ${Number(e.toPrecision(2))}` : "0";
    if (e === null || e === 0 || e < 1e-5 * size) return number(v);
    const places = Math.max(0, 1 - Math.floor(Math.log10(Math.abs(e))));
    if (size >= 1e7 || places > 12) {            // one power of ten for both
      const power = Math.floor(Math.log10(Math.max(size, e))), more = Math.max(0, places + power);
      return `(${(v / 10 ** power).toFixed(more)} ± ${(e / 10 ** power).toFixed(more)})e${power}`;
    }
    return `${(Number(v.toFixed(places)) || 0).toFixed(v.toFixed(places) == 0 ? 0 : places)} ± ${e.toFixed(places)}`;
  };
  const named = (one) => one.unit ? `${one.label} [${one.unit}]` : one.label;

  function ticks(start, end, steps, most) {       // of a logarithmic axis: steps within a decade, all decades or some
    const low = Math.log10(Math.min(start, end)) - 1e-9, high = Math.log10(Math.max(start, end)) + 1e-9, out = [];
    const every = Math.ceil((high - low) / most);
    for (let d = Math.ceil(low / every - 1) * every; d <= high; d += every)
      for (const m of steps) if (d + Math.log10(m) >= low && d + Math.log10(m) <= high) out.push(m * 10 ** d);
    return out;
  }
  function readable(start, end) {                // 1 2 5 10 20, as many as there is room for
    const out = [[1, 2, 5], [1, 3], [1]].map((steps) => ticks(start, end, steps, 10)).find((one) => one.length <= 11);
    if (out.length > 2) return out;
    const size = 10 ** Math.floor(Math.log10((end - start) / 2.5)), all = [];  // of less than a decade even steps
    const step = size * [1, 2, 5].findLast((m) => m * size <= (end - start) / 2.5);
    for (let k = Math.ceil(start / step); k * step <= end; k++) all.push(k * step);
    return all;
  }
  const short = (v) => {                         // a tick: ticks of a narrow axis far from 0 differ in the ninth digit
    const rounded = Number(v.toPrecision(9));
    return rounded === 0 || (Math.abs(v) >= 1e-4 && Math.abs(v) < 1e6) ? rounded.toString() :
      rounded.toExponential().replace("e+", "e");
  };
  const plain = () => new Bokeh.CustomJSTickFormatter({code: "return pictures.short(tick)"});
  function ticked(axis) {                        // labels that are numbers, not powers of ten
    axis.ticker = new Bokeh.CustomJSTicker({major_code: "return pictures.readable(cb_data.range.start, cb_data.range.end)",
      minor_code: "return pictures.ticks(cb_data.range.start, cb_data.range.end, [1, 2, 3, 4, 5, 6, 7, 8, 9], 10)"});
    axis.formatter = plain();
  }

  function figure(x, title, options) {           // x: {label, unit, log} of the axis; title: of the other one
    const fig = Bokeh.Plotting.figure({sizing_mode: "stretch_width", height: 420, x_axis_type: x.log ? "log" : "linear",
      tools: "pan,box_zoom,wheel_zoom,reset,save,tap", background_fill_color: null, border_fill_color: null,
      outline_line_color: ink("--line"), ...options});
    fig.toolbar.logo = null;
    for (const axis of [fig.xaxis, fig.yaxis]) {
      axis.axis_label_text_font_style = "normal";
      for (const part of ["axis_label_text_color", "major_label_text_color"]) axis[part] = ink("--ink");
      for (const part of ["axis_line_color", "major_tick_line_color", "minor_tick_line_color"]) axis[part] = ink("--soft");
      axis.axis_label_text_font_size = "13px";
    }
    for (const grid of [fig.xgrid, fig.ygrid]) grid.grid_line_color = ink("--line");
    fig.xaxis.axis_label = named(x);
    fig.yaxis.axis_label = title;
    for (const [axis, log] of [[fig.xaxis, x.log], [fig.yaxis, options?.y_axis_type === "log"]])
      if (log) ticked(axis); else axis.formatter = plain();
    return fig;
  }

  function legend(fig) {                         // outside the picture, so that it hides no line; a click hides one
    const few = fig.legend.items.length < 4, narrow = innerWidth < 600;
    Object.assign(fig.legend, {label_text_font_size: "12px", background_fill_color: ink("--paper"), background_fill_alpha: 0.8,
      label_text_color: ink("--ink"), border_line_color: null, click_policy: "hide"});
    if (few && !narrow) fig.legend.orientation = "horizontal";
    if (narrow) fig.height += 22 * fig.legend.items.length;
    fig.add_layout(fig.legend, narrow ? "below" : few ? "above" : "right");
  }

  function bar(fig, color_mapper, title) {       // the scale of the colours
    fig.scaled = true;
    const readable = color_mapper.type === "LogColorMapper" ? {formatter: plain()} : {};
    fig.add_layout(new Bokeh.ColorBar({color_mapper, title, ...readable, title_text_color: ink("--ink"),
      title_text_font_style: "normal", major_label_text_color: ink("--ink"), background_fill_color: null}), "right");
  }

  const KEYS = "arrow keys move the picture, + and - scale it, 0 restores it";
  let queue = Promise.resolve();                 // one picture after the other: showing takes its time
  function put(make, place) {                    // make: returns the figure, in the inks that stand
    const fig = make();
    if (place.nextElementSibling?.classList.contains("onpaper")) place.nextElementSibling.remove();
    const twice = Boolean(fig.scaled) && root.dataset.drawn === "dark";
    place.classList.toggle("twice", twice);
    if (fig.height > place.clientHeight) place.style.height = `${fig.height}px`;  // room for the legend below
    show(fig, place);
    if (!twice) return;
    const copy = document.createElement("div");  // a scale of colours cannot be inverted: paper gets a picture of its own
    copy.className = "chart onpaper";
    copy.style.width = `${place.clientWidth}px`;
    copy.setAttribute("aria-hidden", "true");
    place.after(copy);
    root.dataset.inks = "paper";
    try { show(make(), copy); } finally { delete root.dataset.inks; }
  }

  function show(fig, place) {
    queue = queue.then(() => { place.replaceChildren(); return Bokeh.Plotting.show(fig, place); }).then(() => keyed(fig, place));
  }

  function keyed(fig, place) {                   // one stop of the Tab key, not one for each tool, which need a pointer
    const inside = (node) => [...node.querySelectorAll("*")].flatMap((one) => [one, ...(one.shadowRoot ? inside(one.shadowRoot) : [])]);
    for (const one of inside(place)) if (one.hasAttribute("tabindex")) one.tabIndex = -1;
    if (place.classList.contains("onpaper")) return;
    place.tabIndex = 0;
    place.dataset.keys = KEYS;
    place.setAttribute("aria-description", KEYS);
    place.onkeydown = (event) => {
      const [across, up, size] = {ArrowLeft: [-1, 0, 1], ArrowRight: [1, 0, 1], ArrowDown: [0, -1, 1], ArrowUp: [0, 1, 1],
        "+": [0, 0, 0.8], "-": [0, 0, 1.25], 0: []}[event.key] ?? [null];
      if (across === null || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      if (across === undefined) fig.reset.emit();
      else [[fig.x_range, fig.x_scale, across], [fig.y_range, fig.y_scale, up]].forEach(([range, scale, way]) => {
        const log = scale.type === "LogScale", [low, high] = [range.start, range.end].map((v) => log ? Math.log(v) : v);
        const middle = (low + high) / 2 + 0.1 * way * (high - low), half = size * (high - low) / 2;
        const [start, end] = [middle - half, middle + half].map((v) => log ? Math.exp(v) : v);
        range.setv({start, end});
      });
    };
  }

  function themed(draw) {                        // now, and when the reader's theme changes
    const dark = matchMedia("(prefers-color-scheme: dark)");
    const all = () => {
      if (matchMedia("print").matches) return;   // paper takes what stands: the style inverts a dark picture
      root.dataset.drawn = dark.matches ? "dark" : "light";
      draw();
    };
    all();
    dark.addEventListener("change", all);
  }

  return {ink, colours, number, within, named, ticks, readable, short, figure, legend, bar, put, themed};
})();
