"use strict";
// Filter, theme and interactive plots of a paper's page. Text from data only ever becomes text nodes, or is escaped for plotly.
(() => {
const $ = (id) => document.getElementById(id);
const all = (selector, within = document) => [...within.querySelectorAll(selector)];
const node = (tag, attributes = {}, ...children) => {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children);
  return element;
};
async function unpack(id) {
  const bytes = Uint8Array.from(atob($(id).textContent), (c) => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).text();
}

// ---- theme ------------------------------------------------------------------------------------------------------------
const themes = ["system", "light", "dark"];
let theme = "system";
function setTheme(name) {
  theme = themes.includes(name) ? name : "system";
  if (theme === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
  $("page-theme").textContent = `Theme: ${theme}`;
}
try { setTheme(localStorage.getItem("theme")); } catch { /* storage is closed to this page */ }
$("page-theme").addEventListener("click", () => {
  setTheme(themes[(themes.indexOf(theme) + 1) % 3]);
  try { localStorage.setItem("theme", theme); } catch { /* the choice lasts as long as the page */ }
  recolour();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => recolour());

// ---- claims of one state ------------------------------------------------------------------------------------------------
const claims = all(".claim");
const buttons = [];
let state = "";
function filter(wanted) {
  state = wanted;
  for (const claim of claims) claim.hidden = Boolean(state) && claim.dataset.state !== state;
  for (const part of all(".part")) part.hidden = !part.querySelector(".claim:not([hidden])");
  for (const link of all(".chip, .map a")) link.classList.toggle("dim", Boolean(state) && link.dataset.state !== state);
  for (const button of buttons) button.setAttribute("aria-pressed", String(button.dataset.state === state));
}
function choose(wanted) {
  filter(wanted === state ? "" : wanted);
  history.replaceState(null, "", state ? `#state=${state}` : location.pathname + location.search);
}
function pressable(wanted, ...content) {
  const button = node("button", { type: "button", "data-state": wanted, "aria-pressed": "false", onclick: () => choose(wanted) }, ...content);
  buttons.push(button);
  return button;
}
for (const tile of all(".tile[data-state]:not(.zero)")) {
  const words = tile.querySelector(".words").textContent, number = tile.querySelector(".figure").textContent;
  const mark = tile.querySelector(".mark").cloneNode(true);
  const small = pressable(tile.dataset.state, mark, number, node("span", { class: "hidden" }, ` ${words}`));
  small.title = words;
  $("page-filter").append(small);
  tile.append(pressable(tile.dataset.state, ...tile.childNodes));
}
if (all(".tile button").length < 2) $("page-filter").hidden = true;

function follow() {
  const hash = decodeURIComponent(location.hash.slice(1));
  if (hash.startsWith("state=")) {
    filter(all(".tile button").some((button) => button.dataset.state === hash.slice(6)) ? hash.slice(6) : "");
    return;
  }
  const claim = claims.find((one) => one.id === hash);
  if (claim?.hidden) { filter(""); claim.scrollIntoView({ behavior: "instant" }); }
  else if (hash && $(hash)?.hidden) { filter(""); $(hash).scrollIntoView({ behavior: "instant" }); }
}
addEventListener("hashchange", follow);

// ---- where the reader is ------------------------------------------------------------------------------------------------
const places = new Map(all("nav ol a").map((a) => [a.hash.slice(1), a]));
const seen = new Set();
const watcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) if (isIntersecting) seen.add(target.id); else seen.delete(target.id);
  for (const [name, a] of places) if (seen.has(name)) a.setAttribute("aria-current", "true"); else a.removeAttribute("aria-current");
}, { rootMargin: "-12% 0px -80% 0px" });
for (const name of places.keys()) if ($(name)) watcher.observe($(name));

// ---- plots --------------------------------------------------------------------------------------------------------------
const shown = (x) => {
  if (x === null || x === undefined) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  return (size >= 1e-2 && size < 1e5 ? String(Number(x.toPrecision(4))) : x.toExponential(3).replace(/\.?0*e\+?/, "e")).replaceAll("-", "−");
};
const plain = (words) => String(words).replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll(">", "&gt;"); // plotly reads tags
const wrapped = (words, most) => { // lines for a hover label or a title
  const lines = [""];
  for (const word of String(words).split(" ")) {
    if (lines.at(-1) && lines.at(-1).length + word.length >= most) lines.push("");
    lines[lines.length - 1] += (lines.at(-1) ? " " : "") + word;
  }
  return lines.map(plain).join("<br>");
};
const css = (variable) => {
  const probe = node("i", { style: `color:var(${variable})` });
  $("page-main").append(probe);
  const found = getComputedStyle(probe).color;
  probe.remove();
  return found;
};
const faint = (colour, share) => colour.replace(/^rgb\((.*)\)$/, `rgba($1, ${share})`);
const figures = new Map(); // those that plotly draws at present
let charts, plotting;

function colours(figure, data) { // as the still drawing has them
  const marks = all(".keys .key", figure);
  return data.series.map((_, k) => {
    const path = marks[k]?.querySelector("path");
    return path ? getComputedStyle(path).stroke : css("--ink");
  });
}

function axisOf(side, base, vertical, categories, room) {
  const axis = { ...base, title: { ...base.title, text: vertical ? "" : wrapped(side.title, room) }, range: side.range, type: side.log ? "log" : "linear", zeroline: false, showline: true, ticks: "outside", ticklen: 3 };
  if (side.ticks) Object.assign(axis, { tickmode: "array", tickvals: side.ticks.map(([at]) => (side.log ? 10 ** at : at)), ticktext: side.ticks.map(([, words]) => plain(words)) });
  else Object.assign(axis, { nticks: vertical ? 7 : 8, exponentformat: "power" });
  if (categories && !vertical) axis.tickangle = "auto";
  return axis;
}
const place = (side) => (x) => (x === null ? null : side.log && x <= 0 ? (side.lane === null ? null : 10 ** side.lane) : x);
const told = (side) => (x) => (side.names.length && Number.isInteger(x) && side.names[x] ? side.names[x] : shown(x));

function base(figure) {
  const [ink, muted, line, rule] = ["--ink", "--muted", "--line", "--rule"].map(css);
  const axis = { gridcolor: line, linecolor: rule, tickcolor: rule, tickfont: { color: muted, size: 11 }, title: { font: { color: ink, size: 11.5 }, standoff: 8 }, fixedrange: matchMedia("(pointer: coarse)").matches, automargin: true, ticklabeloverflow: "allow" };
  return [axis, { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { family: getComputedStyle(document.body).fontFamily, color: ink, size: 11.5 }, showlegend: false, hovermode: "closest",
    hoverlabel: { font: { size: 12, family: getComputedStyle(document.body).fontFamily }, align: "left" }, dragmode: matchMedia("(pointer: coarse)").matches ? false : "zoom", bargap: 0, barmode: "overlay", height: figure.plotHeight }];
}

function plotOf(figure, data) {
  const [axis, layout] = base(figure), tint = colours(figure, data), paper = css("--paper");
  const [px, py] = [place(data.x), place(data.y)], [tx, ty] = [told(data.x), told(data.y)];
  const order = { bound: 0, ours: 1, other: 2, paper: 3 };
  const traces = [], shapes = [], annotations = [];
  const narrow = figure.clientWidth < 0.85 * figure.querySelector(".still svg").viewBox.baseVal.width; // a phone
  const room = Math.max(24, Math.floor(figure.clientWidth / 6.4)); // letters of a line
  let rows = 0; // of names above the box
  const off = figure.off ??= new Set();
  const label = (name, x, y, more) => [`<b>${wrapped(name || "value", 44)}</b>`, `${wrapped(data.x.title, 40)}: ${plain(x)}`, `${wrapped(data.y.title, 40)}: ${plain(y)}`, ...(more ? [wrapped(more, 52)] : [])].join("<br>");
  const ordered = data.series.map((series, k) => [series, k]).sort(([a], [b]) => order[a.role] - order[b.role]);
  for (const [series, k] of ordered) {
    if (off.has(k)) continue;
    const colour = tint[k], dash = series.dash.replaceAll(/(\S+)\s*/g, "$1px,").replace(/,$/, "") || "solid", width = series.role === "bound" ? 1.2 : 1.6;
    const hover = { hovertemplate: "%{hovertext}<extra></extra>", name: plain(series.name) };
    if (series.kind === "vertical" || series.kind === "horizontal") {
      const upright = series.kind === "vertical", side = upright ? data.x : data.y, at = (upright ? px : py), low = (upright ? data.y : data.x);
      const ends = low.range.map((x) => (low.log ? 10 ** x : x));
      series.x.forEach((x, j) => {
        if (x === null) return;
        const where = at(x);
        shapes.push({ type: "line", layer: "above", line: { color: colour, width, dash }, ...(upright ? { x0: where, x1: where, yref: "paper", y0: 0, y1: 1 } : { y0: where, y1: where, xref: "paper", x0: 0, x1: 1 }) });
        const label = `<b>${wrapped(series.name, 44)}</b><br>${wrapped(side.title, 40)}: ${plain((upright ? tx : ty)(x))}`;
        const along = Array.from({ length: 25 }, (_, i) => (low.log ? ends[0] * (ends[1] / ends[0]) ** (i / 24) : ends[0] + (ends[1] - ends[0]) * (i / 24)));
        const across = along.map(() => where);
        traces.push({ ...hover, type: "scatter", mode: "markers", marker: { opacity: 0, size: 8, color: colour }, x: upright ? across : along, y: upright ? along : across, hovertext: along.map(() => label) });
        if (j || !series.name) return;
        const named = series.role !== "paper" || /paper/i.test(series.name) ? series.name : `${series.name} (paper)`;
        const words = { text: plain(named.length > 40 ? `${named.slice(0, 39)}…` : named), font: { color: series.role === "bound" ? css("--muted") : colour, size: 11 }, borderpad: 1 };
        if (!upright) { annotations.push({ ...words, showarrow: false, bgcolor: faint(paper, 0.8), y: side.log ? Math.log10(where) : where, yanchor: "bottom", xref: "paper", x: 1, xanchor: "right" }); return; }
        const row = narrow ? rows++ : series.row, share = (side.log ? Math.log10(where) : where) - side.range[0];
        const back = narrow ? share > 0.5 * (side.range[1] - side.range[0]) : series.back;
        rows = Math.max(rows, row + 1);
        annotations.push({ ...words, showarrow: true, arrowhead: 0, arrowcolor: colour, arrowwidth: width, ax: 0, ay: -13 * row - 10, standoff: 0, x: side.log ? Math.log10(where) : where, xanchor: back ? "right" : "left", yref: "paper", y: 1, yanchor: "middle" });
      });
      continue;
    }
    if (series.kind === "bars") {
      const edges = series.x.map(px), counts = series.y;
      const middle = counts.map((_, j) => (data.x.log ? Math.sqrt(edges[j] * edges[j + 1]) : (edges[j] + edges[j + 1]) / 2));
      traces.push({ ...hover, type: "bar", x: middle, y: counts, width: counts.map((_, j) => edges[j + 1] - edges[j]), ...(data.x.log ? { x: edges.slice(0, -1), offset: 0 } : {}),
        marker: { color: faint(colour, 0.28), line: { color: colour, width: 1 } }, hovertext: counts.map((y, j) => label(series.name, `${shown(series.x[j])} to ${shown(series.x[j + 1])}`, shown(y), series.text?.[j])) });
      continue;
    }
    const x = series.x.map(px), y = series.y.map(py), line = series.kind === "line";
    const many = x.length > 400, symbol = (series.role === "paper" ? "diamond" : series.square ? "square" : "circle") + (series.hollow ? "-open" : "");
    traces.push({ ...hover, type: "scatter", mode: line ? "lines" : "markers", x, y, connectgaps: false, ...(line ? { line: { color: colour, width, dash } } : {}),
      marker: { color: x.length > 3000 ? faint(colour, 0.35) : many ? faint(colour, 0.6) : colour, symbol, size: many || series.role === "bound" ? 3.6 : x.length > 60 ? 5 : 7, line: { width: series.hollow ? 1.5 : 0, color: colour } },
      hovertext: x.map((_, j) => label(series.name, tx(series.x[j]), ty(series.y[j]), series.text?.[j])) });
  }
  annotations.push({ text: wrapped(data.y.title, room), showarrow: false, xref: "paper", yref: "paper", x: 0, xanchor: "left", xshift: -Math.min(data.left, 60) + 4, y: 1, yanchor: "bottom", yshift: 6 + 13 * rows, align: "left", font: { size: 11.5, color: css("--ink") } });
  return [traces, { ...layout, shapes, annotations, margin: { l: 44, r: 14, t: 28 + 13 * rows, b: 44 }, xaxis: axisOf(data.x, axis, false, data.x.names.length, room), yaxis: axisOf(data.y, axis, true, data.y.names.length) }];
}

const TINTS = 11;
function heatOf(figure, data) {
  const [axis, layout] = base(figure);
  const still = figure.querySelector(".still svg"), scale = [];
  for (let k = 0; k < TINTS; k++) {
    const rect = document.createElementNS("http://www.w3.org/2000/svg", "rect");
    rect.setAttribute("class", `t${k}`);
    still.append(rect);
    figure.classList.remove("drawn"); // what is not rendered has no style
    scale.push([k / (TINTS - 1), getComputedStyle(rect).fill]);
    rect.remove();
  }
  const width = (figure.clientWidth - data.left) / Math.max(1, data.columns.length);
  const fits = width * data.columns.length > 0.8 * (figure.querySelector(".still svg").viewBox.baseVal.width - data.left); // not on a phone
  const side = (names) => ({ tickmode: "array", tickvals: names.map((_, k) => k), ticktext: names.map((name) => plain(name.length > 28 ? `${name.slice(0, 27)}…` : name)), showgrid: false, zeroline: false, ticks: "" });
  const hovertext = data.rows.map((row, i) => data.columns.map((column, j) => [`<b>${wrapped(row, 44)}</b>`, wrapped(`${data.x}: ${column}`, 44), data.values[i][j], ...(data.words[i][j] !== data.values[i][j] ? [wrapped(data.words[i][j], 44)] : [])].join("<br>")));
  const trace = { type: "heatmap", x: data.columns.map((_, k) => k), y: data.rows.map((_, k) => k), z: data.score, zmin: -1, zmax: 1, colorscale: scale, showscale: false, xgap: 2, ygap: 2, hoverongaps: false, hovertext, hovertemplate: "%{hovertext}<extra></extra>",
    ...(fits ? { text: data.lines.map((row) => row.map((lines) => lines.map(plain).join("<br>"))), texttemplate: "%{text}", textfont: { color: css("--ink"), size: 11 } } : {}) };
  return [[trace], { ...layout, margin: { l: 44, r: 10, t: 26, b: 40 }, xaxis: { ...axis, ...side(data.columns), title: { ...axis.title, text: plain(data.x) } }, yaxis: { ...axis, ...side(data.rows), autorange: "reversed", title: { text: "" } },
    annotations: [{ text: plain(data.y), showarrow: false, xref: "paper", yref: "paper", x: 0, xanchor: "left", xshift: -Math.min(data.left, 60) + 4, y: 1, yanchor: "bottom", yshift: 4, font: { size: 11.5, color: css("--ink") } }] }];
}

function draw(figure) {
  const data = charts[figure.dataset.chart];
  const [traces, layout] = data.kind === "heat" ? heatOf(figure, data) : plotOf(figure, data);
  figure.classList.add("drawn");
  return window.Plotly.react(figure.querySelector(".plot"), traces, layout, { displayModeBar: false, responsive: true, doubleClick: "reset" });
}
function recolour() { for (const figure of figures.keys()) draw(figure); }

async function start(figure) {
  if (figures.has(figure) || figure.dataset.waiting) return;
  figure.dataset.waiting = "true";
  plotting ??= (async () => {
    charts = JSON.parse(await unpack("data-charts"));
    const address = URL.createObjectURL(new Blob([await unpack("data-plotly")], { type: "text/javascript" }));
    await new Promise((resolve, reject) => document.head.append(node("script", { src: address, onload: resolve, onerror: reject })));
    URL.revokeObjectURL(address);
  })();
  await plotting;
  if (!charts[figure.dataset.chart]) return; // nothing to point at
  delete figure.dataset.waiting;
  figure.plotHeight = Math.round(Math.max(240, figure.querySelector(".still").getBoundingClientRect().height)); // the page does not move
  figure.append(node("div", { class: "plot" }));
  figures.set(figure, true);
  for (const item of all(".keys li", figure)) { // a name hides its series
    if (item.querySelector("button")) continue;
    const k = Number(item.dataset.series);
    const button = node("button", { type: "button", "aria-pressed": "true", onclick: () => {
      const off = figure.off ??= new Set();
      if (!off.delete(k)) off.add(k);
      button.setAttribute("aria-pressed", String(!off.has(k)));
      if (figures.has(figure)) draw(figure);
    } }, ...item.childNodes);
    item.append(button);
  }
  await draw(figure);
  const box = figure.querySelector(".plot");
  box.on("plotly_relayout", (change) => { // zoomed in, an axis finds labels of its own
    const data = charts[figure.dataset.chart], update = {};
    for (const [name, side] of [["xaxis", data.x], ["yaxis", data.y]]) {
      if (data.kind !== "plot" || !side.log || !(`${name}.range[0]` in change)) continue;
      const whole = Math.abs(change[`${name}.range[0]`] - side.range[0]) + Math.abs(change[`${name}.range[1]`] - side.range[1]) < 1e-6;
      update[`${name}.tickmode`] = whole ? "array" : "auto";
    }
    if (Object.keys(update).length) window.Plotly.relayout(box, update);
  });
  figure.dataset.drawn = "true";
}
function stop(figure) { // far away a drawing is lighter
  if (!figures.has(figure) || figure.contains(document.activeElement)) return;
  figures.delete(figure);
  const box = figure.querySelector(".plot");
  window.Plotly.purge(box);
  box.remove();
  figure.classList.remove("drawn");
  delete figure.dataset.drawn;
}
const near = new IntersectionObserver((entries) => { for (const { target, isIntersecting } of entries) if (isIntersecting) start(target); }, { rootMargin: "300px" });
const far = new IntersectionObserver((entries) => { for (const { target, isIntersecting } of entries) if (!isIntersecting) stop(target); }, { rootMargin: "4000px" });
for (const figure of all(".chart-box")) {
  near.observe(figure);
  far.observe(figure);
  figure.addEventListener("focusin", () => start(figure));
}
let opened = [];
addEventListener("beforeprint", () => { opened = all("details:not([open])"); for (const one of opened) one.open = true; document.documentElement.dataset.theme = "light"; });
addEventListener("afterprint", () => { for (const one of opened) one.open = false; setTheme(theme); });

follow();
document.documentElement.dataset.ready = "true";
})();
