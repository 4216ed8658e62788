"use strict";
// Case table, single case, charts and switches of a report. Text from data only ever becomes text nodes.
(() => {
const $ = (id) => document.getElementById(id);
const node = (tag, attributes = {}, ...children) => {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child !== null && child !== undefined));
  return element;
};
const NONE = "(none)"; // the filter that passes cases without a value
const words = (name) => (name || "closed form").replaceAll("_", " ");

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
  $("theme").textContent = `Theme: ${theme}`;
}
try { setTheme(localStorage.getItem("theme")); } catch { /* storage is closed to this page */ }
$("theme").addEventListener("click", () => {
  setTheme(themes[(themes.indexOf(theme) + 1) % 3]);
  try { localStorage.setItem("theme", theme); } catch { /* the choice lasts as long as the page */ }
  recolour();
});
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => recolour());

// ---- panels of which one is shown ---------------------------------------------------------------------------------------
for (const group of document.querySelectorAll(".switch")) {
  const panels = [...group.querySelectorAll(":scope > .panel")];
  if (panels.length < 2) continue;
  const buttons = panels.map((panel, i) => node("button", { type: "button", onclick: () => show(i) }, panel.dataset.label));
  const show = (chosen) => panels.forEach((panel, i) => {
    panel.hidden = i !== chosen;
    buttons[i].setAttribute("aria-pressed", i === chosen);
  });
  group.prepend(node("div", { class: "choices", role: "group", "aria-label": group.dataset.name }, ...buttons));
  show(0);
}

// ---- counts of a matrix open their cases ---------------------------------------------------------------------------------
for (const table of document.querySelectorAll("table.matrix[data-t]")) {
  const { t, x, s } = table.dataset;
  for (const count of table.querySelectorAll("a[data-v], a[data-p]")) {
    const { v, p = NONE } = count.dataset, f = count.closest("td").dataset.f;
    const parts = new URLSearchParams({ ...(v ? { v } : {}), b: count.closest("tr").dataset.b, ...(f ? { f } : {}), t, x, ...(f ? { s } : {}), p });
    count.href = `#${parts}`.replaceAll("+", "%20").replaceAll("%3A", ":");
  }
}

// ---- where the reader is ------------------------------------------------------------------------------------------------
const places = new Map([...document.querySelectorAll("nav a")].map((a) => [a.hash.slice(1), a]));
const watcher = new IntersectionObserver((entries) => {
  for (const entry of entries) {
    if (!entry.isIntersecting) continue;
    for (const [name, a] of places) {
      if (name === entry.target.id) a.setAttribute("aria-current", "true"); else a.removeAttribute("aria-current");
    }
  }
}, { rootMargin: "-10% 0px -80% 0px" });
for (const name of places.keys()) if ($(name)) watcher.observe($(name));

// ---- numbers ------------------------------------------------------------------------------------------------------------
const exact = (x) => (x === null || x === undefined ? "–" : typeof x === "string" ? x : Number.isInteger(x) && Math.abs(x) < 1e15 ? String(x) : x.toPrecision(17));
const shown = (x) => {
  if (x === null || x === undefined) return "–";
  if (x === 0) return "0";
  const size = Math.abs(x);
  return (size >= 1e-2 && size < 1e4 ? String(Number(x.toPrecision(3))) : x.toExponential(1)).replaceAll("-", "−");
};
const time = (x) => {
  if (x === null || x === undefined) return "–";
  const [scale, unit] = x >= 1 ? [1, "s"] : x >= 1e-3 ? [1e3, "ms"] : [1e6, "µs"];
  return `${Number((x * scale).toPrecision(3))} ${unit}`;
};

// ---- cases --------------------------------------------------------------------------------------------------------------
const KEYS = { v: "verdict", b: "backend", f: "formulation", t: "task", s: "settings", x: "expected", set: "set", p: "apart" };
const COLUMNS = [
  ["problem", "Case", 94], ["set", "Set", 92], ["expected", "Expected", 116], ["backend", "Backend", 116],
  ["formulation", "Formulation", 102], ["verdict", "Verdict", 108], ["error", "Error", 60, shown], ["tolerance", "Tolerance", 70, shown],
  ["lambda_min_W", "λmin(W)", 68, shown], ["sigma_min_J", "σmin(J)", 64, shown], ["solve_time", "Time", 62, time],
];
const APART = { formulation: "by the formulation", float64: "beyond float64" };
const ROW = 31;
const SEVERE = ["false_success", "wrong_refusal", "crashed", "timed_out", "inaccurate", "limit", "out_of_scope", "undecidable", "right_refusal", "verified", "not_run"];
let data, text, severity, order = [], active = 0, filters = {}, sort = null, open = null, keys, byKey, refresh = () => {};

const name = (column, i) => column.names[column.codes[i]] ?? null;
const identity = (i) => data.cases.problem.codes[i];
const isClosed = (i) => name(data.cases.backend, i).startsWith(data.words.closed);
const value = (column, i) => {
  if (column === "lambda_min_W" || column === "sigma_min_J") return data.problems[column]?.[identity(i)] ?? null;
  const held = data.cases[column];
  return held.names ? name(held, i) : held[i];
};
const label = (column, x) => {
  if (column === "verdict") return data.words.verdicts[x]?.[0] ?? x;
  if (column === "expected") return data.words.expected[x] ?? x ?? "–";
  if (column === "formulation") return words(x);
  if (column === "apart") return APART[x] ?? "no";
  if (column === "backend") return x.startsWith(data.words.closed) ? `${x.slice(data.words.closed.length)} (closed form)` : x;
  return x ?? "–";
};
const verdict = (x) => node("span", { class: `verdict v-${x}` }, label("verdict", x));

function fragment(extra = {}) {
  const parts = new URLSearchParams();
  for (const [short, long] of Object.entries(KEYS)) if (filters[long]) parts.set(short, filters[long]);
  if (filters.text) parts.set("q", filters.text);
  if (sort) parts.set("sort", (sort.down ? "-" : "") + sort.column);
  for (const [key, x] of Object.entries(extra)) if (x) parts.set(key, x);
  return `#${parts}`.replaceAll("+", "%20").replaceAll("%3A", ":").replaceAll("%7E", "~");
}

function passes(table) { // the filters, but for the text, as a test of a row of the cases or of the totals
  const { text: _, ...rest } = filters;
  const tests = Object.entries(rest).filter(([, x]) => x).map(([column, x]) => {
    const { names, codes } = table[column], [judged, level] = data.words.judged, code = names.indexOf(x === judged ? level : x);
    if (x === NONE) return (i) => codes[i] === null;
    return x === judged && column === "settings" ? (i) => codes[i] === null || codes[i] === code : (i) => codes[i] === code;
  });
  return (i) => tests.every((test) => test(i));
}

function total() { // how many records of the run pass the filters
  const pass = passes(data.totals);
  return data.totals.n.reduce((sum, n, i) => (pass(i) ? sum + n : sum), 0);
}

function query(most) { // the command that lists what passes the filters
  const text = (x) => `'${x.replaceAll("'", "''")}'`;
  const [judged, level] = data.words.judged, { text: _, ...rest } = filters;
  const where = Object.entries(rest).filter(([, x]) => x).map(([column, x]) => {
    if (column === "apart") return x === NONE && data.words.own.includes(filters.verdict) ? "true" : data.words.apart[x];
    if (x === NONE) return `${column} is null`;
    return x === judged ? `(settings is null or settings = ${text(level)})` : `${column} = ${text(x)}`;
  });
  const sql = `select problem, set, backend, formulation, settings, verdict, error, tolerance, said from records where ${[data.words.cold, ...where].filter((x) => x !== "true").join(" and ") || "true"} order by error desc, problem`;
  return `sandbox query "${sql.replaceAll(/[\\"$`]/g, "\\$&")}" ${data.words.folder} --limit ${most}`;
}

function select() {
  const wanted = filters.text, pass = passes(data.cases);
  const needle = wanted?.toLowerCase();
  order = [];
  for (let i = 0; i < data.count; i++) {
    if (pass(i) && (!needle || text[i].includes(needle))) order.push(i);
  }
  if (sort) {
    const held = order.map((i) => [value(sort.column, i), i]);
    const sign = sort.down ? -1 : 1;
    held.sort(([a, i], [b, j]) => (a === b ? i - j : a === null ? 1 : b === null ? -1 : sign * (a < b ? -1 : 1)));
    order = held.map(([, i]) => i);
  } else order.sort((i, j) => severity[data.cases.verdict.codes[i]] - severity[data.cases.verdict.codes[j]] || i - j);
  active = 0;
}

function explorer() {
  const box = $("explorer");
  const pickers = {};
  const picker = (column, title) => {
    const held = data.cases[column];
    const counts = new Map();
    for (const code of held.codes) counts.set(code, (counts.get(code) ?? 0) + 1);
    const options = held.names.map((x, code) => [x, counts.get(code) ?? 0]).sort((a, b) => (a[0] < b[0] ? -1 : 1));
    pickers[column] = node("select", { "data-filter": column, onchange: (event) => { filters[column] = event.target.value; changed(); } },
      node("option", { value: "" }, "any"),
      ...options.map(([x, n]) => node("option", { value: x }, `${label(column, x)} (${n})`)),
      counts.has(null) ? node("option", { value: NONE }, `${column === "formulation" ? "closed form" : column === "apart" ? "no" : "none"} (${counts.get(null)})`) : null,
      column === "settings" ? node("option", { value: data.words.judged[0] }, `${data.words.judged[1]} and closed forms`) : null);
    return node("label", {}, title, pickers[column]);
  };
  const search = node("input", { type: "search", placeholder: "problem, said, reason …", oninput: (event) => { filters.text = event.target.value; changed(); } });
  const found = node("output", { "aria-live": "polite" }), elsewhere = node("div", { id: "elsewhere" });
  const head = COLUMNS.map(([column, title, width, format]) => node("th", { scope: "col", class: format ? "num" : "", style: `width:${width}px`, "data-column": column },
    node("button", { type: "button", onclick: () => {
      sort = sort?.column !== column ? { column, down: Boolean(format) } : sort.down === Boolean(format) ? { column, down: !format } : null;
      changed();
    } }, title)));
  const body = node("tbody");
  const table = node("table", { "aria-label": "Cases" }, node("thead", {}, node("tr", {}, ...head)), body);
  const scroller = node("div", { class: "scroller", role: "region", "aria-label": "Cases; arrow keys move, Enter opens", tabindex: "0" }, table);
  box.append(
    node("div", { class: "filters" }, picker("verdict", "Verdict"), picker("backend", "Backend"), picker("formulation", "Formulation"), picker("set", "Set"),
      picker("expected", "Expected"), picker("task", "Task"), picker("settings", "Settings"), picker("apart", "Held apart"), node("label", {}, "Text", search)),
    node("div", { class: "tools" }, found, node("button", { type: "button", id: "clear", onclick: () => { filters = {}; sort = null; changed(); } }, "Clear"),
      node("button", { type: "button", id: "csv", onclick: csv }, "Save as CSV")),
    elsewhere, scroller);

  const draw = () => {
    const height = scroller.clientHeight || 528;
    const first = Math.max(0, Math.floor(scroller.scrollTop / ROW) - 6);
    const last = Math.min(order.length, first + Math.ceil(height / ROW) + 14);
    const held = body.contains(document.activeElement);
    const space = (rows) => node("tr", { class: "spacer", "aria-hidden": "true" }, node("td", { colspan: COLUMNS.length, style: `height:${rows * ROW}px` }));
    const rows = [];
    for (let place = first; place < last; place++) {
      const i = order[place];
      const link = node("a", { href: fragment({ case: keys[i] }), tabindex: place === active ? "0" : "-1", "data-place": place, title: value("problem", i) }, value("problem", i).slice(0, 12));
      rows.push(node("tr", { "aria-rowindex": place + 2, class: place === active ? "active" : "" }, ...COLUMNS.map(([column, , , format], k) => {
        if (k === 0) return node("th", { scope: "row" }, node("code", {}, link));
        const x = value(column, i);
        return node("td", { class: format ? "num" : "", title: format || column === "verdict" ? null : label(column, x) }, column === "verdict" ? verdict(x) : format ? format(x) : label(column, x));
      })));
    }
    table.setAttribute("aria-rowcount", order.length + 1);
    body.replaceChildren(space(first), ...rows, space(Math.max(0, order.length - last)));
    if (held) body.querySelector(`[data-place="${active}"]`)?.focus({ preventScroll: true });
  };
  let waiting = false;
  scroller.addEventListener("scroll", () => {
    if (waiting) return;
    waiting = true;
    requestAnimationFrame(() => { waiting = false; draw(); });
  });
  scroller.addEventListener("keydown", (event) => {
    const page = Math.floor(scroller.clientHeight / ROW) - 2;
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -order.length, End: order.length }[event.key];
    if (step === undefined || !order.length || event.target.closest("thead")) {
      if (event.key === "Enter" && event.target === scroller && order.length) location.hash = fragment({ case: keys[order[active]] });
      return;
    }
    event.preventDefault();
    active = Math.max(0, Math.min(order.length - 1, active + step));
    const top = active * ROW, room = scroller.clientHeight - 36 - ROW;
    if (top < scroller.scrollTop) scroller.scrollTop = top;
    else if (top > scroller.scrollTop + room) scroller.scrollTop = top - room;
    draw();
    body.querySelector(`[data-place="${active}"]`)?.focus({ preventScroll: true });
  });
  body.addEventListener("click", (event) => {
    const link = event.target.closest("tr")?.querySelector("a");
    if (link && event.target !== link && !String(getSelection())) location.hash = link.hash;
  });
  const changed = (from) => {
    select();
    if (from !== "hash") history.replaceState(null, "", fragment());
    refresh();
  };
  refresh = () => {
    for (const [column, picker] of Object.entries(pickers)) picker.value = filters[column] ?? "";
    if (search.value !== (filters.text ?? "")) search.value = filters.text ?? "";
    const filtered = Object.values(filters).some(Boolean), all = filters.text ? data.count : total();
    found.textContent = `Showing ${order.length.toLocaleString("en")} of ${all.toLocaleString("en")} ` +
      (filters.text ? "cases in this page" : `${all === 1 ? "record" : "records"}${filtered ? ` that ${all === 1 ? "passes" : "pass"} the filter` : ""}`);
    elsewhere.replaceChildren(...(filtered && !filters.text && order.length < all
      ? [node("p", {}, `${order.length ? "The others are" : "None of them is in this page: they are"} in the run folder. This lists all ${all.toLocaleString("en")}:`), copyable(query(all))[0]] : []));
    for (const th of head) {
      if (th.dataset.column === sort?.column) th.setAttribute("aria-sort", sort.down ? "descending" : "ascending");
      else th.removeAttribute("aria-sort");
    }
    scroller.scrollTop = 0;
    draw();
  };
  box.hidden = false;
}

function csv() {
  const columns = ["problem", "set", "task", "expected", "backend", "formulation", "settings", "verdict", "status", "said", "error", "tolerance",
    "posing_error", "blame", "primal_residual", "dual_residual", "objective_gap", "multiplier_error", "iterations", "build_time", "solve_time",
    "lambda_min_W", "sigma_min_J", "kappa", "qdot", "y"];
  const field = (x) => (x === null || x === undefined ? "" : `"${(Array.isArray(x) ? x.join(" ") : String(x)).replaceAll('"', '""')}"`);
  const lines = [columns.join(","), ...order.map((i) => columns.map((column) => field(value(column, i))).join(","))];
  const address = URL.createObjectURL(new Blob([lines.join("\r\n"), "\r\n"], { type: "text/csv;charset=utf-8" }));
  node("a", { href: address, download: "cases.csv" }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

// ---- one case -----------------------------------------------------------------------------------------------------------
function square(values, size) { // the upper triangle of a symmetric matrix, or the whole
  if (!values) return null;
  if (values.length === size * size && size !== 1) return rows(values, size);
  const matrix = Array.from({ length: size }, () => Array(size));
  let k = 0;
  for (let i = 0; i < size; i++) for (let j = i; j < size; j++) matrix[i][j] = matrix[j][i] = values[k++];
  return matrix;
}
const rows = (values, width) => (values ? Array.from({ length: values.length / width }, (_, i) => values.slice(i * width, (i + 1) * width)) : null);
const quoted = (x) => (/^[\w@%+=:,./-]+$/.test(x) ? x : `'${x.replaceAll("'", `'"'"'`)}'`);
const python = (x) => (Array.isArray(x) ? `[${x.map(python).join(", ")}]` : Number.isInteger(x) ? `${x}.0` : String(x));

function digits(title, matrix, heads) {
  const cells = matrix.map((row, i) => node("tr", {}, heads ? node("th", { scope: "row" }, String(i + 1)) : null, ...row.map((x) => node("td", {}, exact(x)))));
  return node("div", { class: "scroll", role: "region", "aria-label": title, tabindex: "0" }, node("table", { class: "digits" },
    heads ? node("thead", {}, node("tr", {}, ...heads.map((head) => node("th", { scope: "col" }, head)))) : null, node("tbody", {}, ...cells)));
}

function facts(pairs) {
  return node("dl", { class: "facts" }, ...pairs.filter(([, x]) => x !== null && x !== undefined && x !== "")
    .flatMap(([term, x]) => [node("dt", {}, term), node("dd", {}, x)]));
}

function copyable(content) {
  const button = node("button", { type: "button", class: "quiet", onclick: async () => {
    try { await navigator.clipboard.writeText(content); button.textContent = "Copied"; } catch { button.textContent = "Select and copy"; }
  } }, "Copy");
  return [node("pre", { class: "command", tabindex: "0" }, node("code", {}, content)), node("p", {}, button)];
}

function showCase(key) {
  const dialog = $("case");
  const i = byKey.get(key);
  const step = (by) => { const place = order.indexOf(i); const next = order[place + by]; return place < 0 || next === undefined ? null : fragment({ case: keys[next] }); };
  const go = (by, title) => node("button", { type: "button", disabled: step(by) === null, onclick: () => { location.hash = step(by); } }, title);
  const close = node("button", { type: "button", onclick: () => dialog.close() }, "Close");
  if (i === undefined) {
    dialog.replaceChildren(node("div", { class: "head" }, node("h2", { id: "case-title" }, "This case is not in the page"), close),
      node("div", { class: "body" }, node("p", {}, "The page embeds a choice of the cases. The run folder has it:"), ...copyable(command(key.split("~"))[0])));
  } else dialog.replaceChildren(node("div", { class: "head" }, node("h2", { id: "case-title" }, `Case ${value("problem", i)}`), go(-1, "Previous"), go(1, "Next"), close),
    node("div", { class: "body" }, ...caseBody(i)));
  dialog.scrollTop = 0;
  open = key;
  if (!dialog.open) dialog.showModal();
}
$("case").addEventListener("close", () => {
  open = null;
  if (new URLSearchParams(location.hash.slice(1)).has("case")) history.replaceState(null, "", fragment());
});
$("case").addEventListener("click", (event) => { if (event.target === $("case")) $("case").close(); });

function command([problem, backend, formulation, settings]) {
  const call = `sandbox show ${data.words.folder} ${problem} --backend ${quoted(backend)}` + (formulation ? ` --formulation ${formulation}` : "") + (settings ? ` --settings ${settings}` : "");
  return [call, `${call} --script`];
}

function caseBody(i) {
  const p = identity(i), problems = data.problems, get = (column) => problems[column]?.[p] ?? null;
  const truth = data.truths[value("task", i)], t = (column) => truth?.[column]?.[p] ?? null;
  const n = get("n"), m = get("m");
  const status = value("status", i);
  const [call, script] = command([value("problem", i), value("backend", i), value("formulation", i), value("settings", i)]);
  const yesno = (x) => (x === null ? null : x ? "yes" : "no");
  const parts = [
    node("p", {}, verdict(value("verdict", i)), ` — ${label("backend", value("backend", i))}, ${words(value("formulation", i))}`,
      value("settings", i) ? `, ${value("settings", i)}` : "", `: ${data.words.statuses[status] ?? status ?? "no status"}. Expected: ${label("expected", value("expected", i))}`,
      t("reason") ? ` (${t("reason")}).` : "."),
    node("h3", {}, "What it said"),
    node("div", { class: "quote", tabindex: "0", role: "region", "aria-label": "What it said" }, value("said", i) || "(nothing)"),
    node("div", { class: "columns" },
      facts([["Error", exact(value("error", i))], ["Tolerance", exact(value("tolerance", i))], ["Bound on the reference", shown(value("error_bound", i))], ["Posing error", shown(value("posing_error", i))],
        ["Blame", value("blame", i)], ["Held apart", value("apart", i) && label("apart", value("apart", i))], ["Residuals met", yesno(value("residuals_met", i))], ["Attainable", yesno(value("attainable", i))], ["Reason given was right", yesno(value("reason_right", i))],
        ["Primal residual", shown(value("primal_residual", i))], ["Dual residual", shown(value("dual_residual", i))], ["Objective gap", shown(value("objective_gap", i))],
        ["Multiplier error", shown(value("multiplier_error", i))]]),
      facts([["Status", status], ["Finite point found", yesno(value("found", i))], ["Iterations", value("iterations", i)?.toString()], ["Time to build", time(value("build_time", i))], ["Time to solve", time(value("solve_time", i))], ["Time in the worker", time(value("runtime", i))],
        ["Time limit", value("time_limit", i) === null ? null : time(value("time_limit", i))], ["Versions", [value("library_version", i), value("engine_version", i)].filter(Boolean).join(", engine ")],
        ["Set", value("set", i)], ["Task", words(value("task", i))], ["Robot", get("robot")], ["Method", get("method")], ["Case", get("case")], ["Seed", get("seed")?.toString()],
        [get("knob"), get("value") === null ? null : exact(get("value"))], ["Rank of J", t("rank")?.toString()], ["Inertia of NᵀWN", t("inertia") ? `${t("inertia").join(", ")} (+, −, 0)` : null],
        ["Margin", t("margin") === null ? null : shown(t("margin"))], ["λmin(W)", shown(get("lambda_min_W"))], ["λmin(NᵀWN)", shown(get("lambda_min_reduced"))], ["σmin(J)", shown(get("sigma_min_J"))], ["κ", shown(value("kappa", i))]].filter(([term]) => term))),
  ];
  const compare = (title, own, right) => {
    if (!own && !right) return;
    const size = (own ?? right).length;
    const table = Array.from({ length: size }, (_, k) => [own ? own[k] ?? "not finite" : null, right?.[k] ?? null, own && right && own[k] !== null ? own[k] - right[k] : null]);
    parts.push(node("h3", {}, title), digits(title, table, ["", "answer", "truth", "difference"]));
  };
  compare("q̇, joint rates", value("qdot", i), t("x"));
  compare("y, multipliers", value("y", i), t("y"));
  const freedom = t("freedom");
  if (freedom?.length && n) parts.push(node("p", { class: "note" }, "The minimum is not unique: any sum of q̇ and these columns is right."), digits("Freedom", rows(freedom, freedom.length / n)));
  if (n) {
    const W = square(get("W_base"), n), k = get("k");
    const given = [["J", rows(get("J"), n)], ["ẋ", get("xdot") && [get("xdot")]], [k ? "W, base" : "W", W], ["W, factor E", k ? rows(get("W_E"), n) : null], ["W, factor Γ", k ? square(get("W_gamma"), k) : null],
      ["a", get("a") && [get("a")]], ["Wx", square(get("Wx"), m)]];
    for (const [title, matrix] of given) if (matrix) parts.push(node("h3", {}, title), digits(title, matrix));
    const weight = k ? `sandbox.Weight(${python(W)}, E=${python(rows(get("W_E"), n))}, gamma=${python(square(get("W_gamma"), k))})` : python(W);
    parts.push(node("h3", {}, "As Python"), ...copyable(`import sandbox\n\np = sandbox.VelocityProblem(J=${python(rows(get("J"), n))}, xdot=${python(get("xdot"))}, W=${weight}, a=${python(get("a"))}${get("Wx") ? `, Wx=${python(square(get("Wx"), m))}` : ""})`));
  } else parts.push(node("p", {}, "The run folder does not hold the matrices of this problem."));
  parts.push(node("h3", {}, "Repeat it"), ...copyable(`${call}\n${script}`));
  const siblings = [];
  for (let j = 0; j < data.count; j++) if (j !== i && identity(j) === p) siblings.push(j);
  if (siblings.length) {
    parts.push(node("h3", {}, "The same problem elsewhere"), node("ul", { class: "siblings" }, ...siblings.map((j) =>
      node("li", {}, verdict(value("verdict", j)), " ", node("a", { href: fragment({ case: keys[j] }) }, `${label("backend", value("backend", j))}, ${words(value("formulation", j))}${value("settings", j) === "default" ? ", default" : ""}`)))));
  }
  return parts;
}

// ---- the address --------------------------------------------------------------------------------------------------------
function follow() {
  const hash = location.hash.slice(1);
  if (!hash.includes("=")) { if ($("case").open) $("case").close(); return; }
  const parts = new URLSearchParams(hash.replaceAll("+", "%2B"));
  const key = parts.get("case");
  const wanted = {};
  for (const [short, long] of Object.entries(KEYS)) if (parts.get(short)) wanted[long] = parts.get(short);
  if (parts.get("q")) wanted.text = parts.get("q");
  const by = parts.get("sort");
  const column = by?.replace(/^-/, "");
  const wantedSort = COLUMNS.some(([held]) => held === column) ? { column, down: by.startsWith("-") } : null;
  const same = JSON.stringify([wanted, wantedSort]) === JSON.stringify([Object.fromEntries(Object.entries(filters).filter(([, x]) => x)), sort]);
  const moved = Object.keys(wanted).length || wantedSort;
  if (!same && (moved || !key || !order.length)) {
    [filters, sort] = [wanted, wantedSort];
    select();
    refresh();
    if (!key) $("cases").scrollIntoView({ behavior: "instant" });
  } else if (!key) $("cases").scrollIntoView({ behavior: "instant" });
  if (key) showCase(key); else if ($("case").open) $("case").close();
}

async function startCases() {
  data = JSON.parse(await unpack("data-cases"));
  const held = data.cases;
  keys = Array.from({ length: data.count }, (_, i) => [value("problem", i), value("backend", i), value("formulation", i) ?? "", value("settings", i) ?? "", value("task", i) ?? "",
    ...(held.repeat[i] ? [held.repeat[i]] : [])].join("~"));
  byKey = new Map(keys.map((key, i) => [key, i]));
  text = Array.from({ length: data.count }, (_, i) => [value("problem", i), value("backend", i), value("said", i), value("status", i), value("set", i), words(value("formulation", i)),
    label("verdict", value("verdict", i)), data.truths[value("task", i)]?.reason?.[identity(i)], data.problems.robot?.[identity(i)], data.problems.method?.[identity(i)], data.problems.case?.[identity(i)]].join("\n").toLowerCase());
  severity = held.verdict.names.map((x) => SEVERE.indexOf(x));
  explorer();
  select();
  refresh();
  addEventListener("hashchange", follow);
  follow();
  for (const listing of document.querySelectorAll(".listing")) listing.addEventListener("toggle", () => fill(listing), { once: true });
  document.documentElement.dataset.ready = "true";
}

function fill(listing) {
  const found = [];
  for (let i = 0; i < data.count; i++) {
    if (value("verdict", i) === listing.dataset.verdict && value("backend", i) === listing.dataset.backend && [null, data.words.judged[1]].includes(value("settings", i)) && !value("apart", i)) found.push(i);
  }
  found.sort((i, j) => (value("error", j) ?? Infinity) - (value("error", i) ?? Infinity) || i - j);
  listing.append(node("ol", { tabindex: "0" }, ...found.map((i) => node("li", {}, node("a", { href: fragment({ case: keys[i] }) }, node("code", {}, value("problem", i))),
    ` ${words(value("formulation", i))}, ${value("set", i)}, ${label("expected", value("expected", i))}${value("error", i) === null ? "" : `, error ${shown(value("error", i))}`}`))));
}

// ---- charts -------------------------------------------------------------------------------------------------------------
const LIBRARIES = ["closed_form", "osqp", "proxsuite", "qpsolvers", "cvxpy", "casadi", "numpy", "scipy"];
const LIGHT = ["#1d1f23", "#c0301f", "#0f7a5c", "#2a72ad", "#9b4a98", "#b87400", "#5b5e66", "#6d5a1e"];
const DARK = ["#e9e7e2", "#ff8b78", "#4ec9a4", "#6db5ea", "#d795d2", "#f0b95c", "#a7aab2", "#cdbb7a"];
const DASHES = ["solid", "2px,2px", "6px,3px", "11px,3px", "6px,2px,2px,2px", "11px,2px,2px,2px", "2px,4px", "6px,2px,2px,2px,2px,2px", "4px,4px", "11px,2px,5px,2px", "1px,2px"];
const GREY = "#9a9da4"; // what stands back, and points of few problems
const FEW = 5;
const FIRST = ["closed_form:eq6", "osqp", "proxsuite:dense", "qpsolvers:daqp", "qpsolvers:piqp", "qpsolvers:clarabel", "casadi:qrqp", "numpy:lstsq"]; // unlike each other
const MANY = 12;
const charts = [];
let curves, plotting;

function dark() { return getComputedStyle($("main")).color.match(/\d+/g).slice(0, 3).reduce((sum, x) => sum + Number(x), 0) > 384; }

function style(backend) {
  const library = backend.split(":")[0];
  const own = curves.order.filter((other) => other.split(":")[0] === library);
  const place = LIBRARIES.indexOf(library);
  return { color: (dark() ? DARK : LIGHT)[place < 0 ? 6 : place], width: library === "closed_form" ? 2 : 1.6, dash: DASHES[own.indexOf(backend) % DASHES.length] };
}
const title = (backend) => (backend.startsWith(curves.closed) ? backend.slice(curves.closed.length) : backend);

function layout(extra) {
  const css = (variable) => { const probe = node("i", { style: `color:var(${variable})` }); $("main").append(probe); const found = getComputedStyle(probe).color; probe.remove(); return found; };
  const [ink, muted, line] = [css("--ink"), css("--muted"), css("--line")];
  const axis = { gridcolor: line, zerolinecolor: line, linecolor: line, tickfont: { color: muted, size: 11.5 }, title: { font: { color: muted, size: 12.5 } } };
  const base = { paper_bgcolor: "rgba(0,0,0,0)", plot_bgcolor: "rgba(0,0,0,0)", font: { family: getComputedStyle(document.body).fontFamily, color: ink, size: 12 },
    margin: { l: 58, r: 12, t: 26, b: 46 }, hovermode: "closest", hoverlabel: { font: { size: 12 } }, showlegend: false };
  const axes = {};
  for (const [key, own] of Object.entries(extra)) {
    if (/^[xy]axis/.test(key)) axes[key] = { ...axis, ...own, title: { ...axis.title, ...(own.title ?? {}) } };
  }
  for (const note of extra.annotations ?? []) note.font = { color: ink, size: 12.5 };
  return { ...base, ...extra, ...axes };
}
const powers = (from, to, by) => { const at = []; for (let k = from; k <= to; k += by) at.push(k); return { tickmode: "array", tickvals: at, ticktext: at.map((k) => `1e${String(k).replace("-", "−")}`) }; };

function choice(text, options, changed) {
  const picker = node("select", { onchange: () => changed() }, ...options.map(([x, shown]) => node("option", { value: x }, shown)));
  return [node("label", {}, `${text} `, picker), () => picker.value];
}

const posed = () => { // every way of posing that has curves, with the task it belongs to
  const found = new Map();
  for (const row of curves.distributions) if (row.formulation) found.set(row.formulation, row.task);
  return curves.formulations.filter((name) => found.has(name)).map((name) => [name, found.get(name)]);
};

function distribution(what, figure) {
  const ways = posed();
  const steps = what === "error" ? 5 : 10;
  const levels = what === "error" ? [...new Set(curves.distributions.map((row) => row.settings).filter(Boolean))].filter((x) => x === curves.judged || x === "default") : [curves.judged];
  levels.sort((a) => (a === curves.judged ? -1 : 1));
  const redraw = () => plot(figure);
  const [wayLabel, way] = choice("Posed", ways.length ? ways.map(([name]) => [name, words(name)]) : [["", "closed forms"]], redraw);
  const [levelLabel, level] = choice("Settings", levels.map((x) => [x, x]), redraw);
  const heading = node("strong", {}, what === "error" ? "Relative error" : "Time to solve, where verified");
  return { controls: [heading, wayLabel, levels.length > 1 ? levelLabel : null], draw: () => {
    const task = ways.find(([name]) => name === way())?.[1] ?? "exact";
    const traces = [];
    const own = curves.distributions.filter((row) => row.task === task && (row.formulation === null ? true : row.formulation === way() && row.settings === (level() || curves.judged)) && row[`${what}_bins`]);
    own.sort((a, b) => curves.order.indexOf(a.backend) - curves.order.indexOf(b.backend));
    for (const row of own) {
      const at = row[`${what}_bins`].map((k) => k / steps), reached = row[`${what}_reached`].map((k) => k / row.total);
      const end = what === "error" ? 3 : 1;
      traces.push({ x: [at[0] - 1 / steps, ...at, Math.max(end, at.at(-1))], y: [0, ...reached, reached.at(-1)], name: title(row.backend), mode: "lines", backend: row.backend, line: style(row.backend),
        text: [at[0] - 1 / steps, ...at, end].map((k) => (what === "error" ? shown(10 ** k) : time(10 ** k))), hovertemplate: `%{y:.1%} ${what === "error" ? "within" : "in"} %{text}<extra>%{fullData.name}</extra>` });
    }
    const range = what === "error" ? [-17, 3] : [-6.2, 1];
    return [traces, layout({ xaxis: { title: { text: what === "error" ? "relative error of q̇" : "seconds" }, range, ...powers(Math.ceil(range[0]), range[1], what === "error" ? 2 : 1) }, yaxis: { title: { text: "share of problems" }, range: [0, 1.02], tickformat: ".0%" } })];
  } };
}

function breakdown(over, figure) {
  const held = over === "lambda" ? curves.over_lambda : curves.over_sigma;
  const redraw = () => plot(figure);
  const [metricLabel, metric] = choice("Show", [["share", "share verified"], ["error", "median error"]], redraw);
  const panels = ["direct", "convexified", "null_space"].filter((name) => held.some((row) => row.formulation === name));
  const heading = node("strong", {}, "The same problems posed three ways");
  return { controls: [heading, metricLabel], draw: () => {
    const traces = [], extra = { annotations: [] };
    const decades = held.map((row) => row.decade), low = Math.min(...decades), high = Math.max(...decades);
    panels.forEach((name, k) => {
      const suffix = k ? String(k + 1) : "", width = 1 / panels.length, gap = 0.022;
      extra[`xaxis${suffix}`] = { domain: [k * width + (k ? gap : 0), (k + 1) * width - (k < panels.length - 1 ? gap : 0)], anchor: `y${suffix}`, ...powers(low, high, high - low > 8 ? 3 : 2),
        range: over === "lambda" ? [low - 0.4, high + 0.4] : [high + 0.4, low - 0.4], title: { text: over === "lambda" ? "−λmin(W)" : "σmin(J)" } };
      extra[`yaxis${suffix}`] = { anchor: `x${suffix}`, showticklabels: k === 0, ...(metric() === "share" ? { range: [-0.03, 1.04], tickformat: ".0%" } : { range: [-17, 3], ...powers(-16, 2, 4) }), ...(k ? { matches: "y" } : { title: { text: metric() === "share" ? "share verified" : "median error" } }) };
      extra.annotations.push({ text: `<b>${words(name)}</b>`, x: k * width + (k ? gap : 0), y: 1.075, xref: "paper", yref: "paper", xanchor: "left", showarrow: false });
      for (const backend of curves.order) {
        const own = held.filter((row) => row.backend === backend && (row.formulation === name || (k === 0 && row.formulation === null)) && (metric() === "share" || row.error !== null));
        if (!own.length) continue;
        traces.push({ x: own.map((row) => row.decade), y: own.map((row) => (metric() === "share" ? row.verified / row.n : Math.log10(Math.max(row.error, 1e-17)))), name: title(backend), backend, xaxis: `x${suffix}`, yaxis: `y${suffix}`,
          mode: "lines+markers", marker: { size: 3.5, ...(own.some((row) => row.n < FEW) ? { color: own.map((row) => (row.n < FEW ? GREY : style(backend).color)) } : {}) }, line: style(backend), text: own.map((row) => `${row.verified} of ${row.n}`), hovertemplate: "%{text} verified at 1e%{x}<extra>%{fullData.name}</extra>" });
      }
    });
    return [traces, layout(extra)];
  } };
}

function ratio() {
  const heading = node("strong", {}, "Error over the form's own bound");
  return { controls: [heading], draw: () => {
    const traces = curves.ratios.filter((row) => row.ratios.length).map((row) => {
      let sum = 0;
      const at = row.ratios.map(([bin]) => bin / 5), reached = row.ratios.map(([, n]) => (sum += n));
      return { x: [at[0] - 0.2, ...at], y: [0, ...reached.map((n) => n / sum)], name: title(row.backend), backend: row.backend, mode: "lines", line: { width: 1.8 },
        text: [at[0] - 0.2, ...at].map((k) => shown(10 ** k)), hovertemplate: "%{y:.1%} within %{text} of the bound<extra>%{fullData.name}</extra>" };
    });
    const colours = (dark() ? DARK : LIGHT);
    traces.forEach((trace, k) => { trace.line.color = colours[k % colours.length]; trace.line.dash = DASHES[Math.floor(k / colours.length) * 2]; });
    const lowest = Math.floor(Math.min(-4, ...traces.map((trace) => trace.x[0])));
    return [traces, layout({ xaxis: { title: { text: "error / bound" }, range: [Math.max(-12, lowest), 2], ...powers(-12, 2, 2) }, yaxis: { title: { text: "share of answers" }, range: [0, 1.02], tickformat: ".0%" },
      shapes: [{ type: "line", x0: 0, x1: 0, y0: 0, y1: 1, yref: "paper", line: { color: colours[1], width: 1.5, dash: "dot" } }] })];
  } };
}

function sample(line) { // the stroke of a curve beside its name
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg"), stroke = document.createElementNS("http://www.w3.org/2000/svg", "line");
  for (const [key, x] of Object.entries({ width: 26, height: 8, "aria-hidden": "true" })) svg.setAttribute(key, x);
  const dash = line.dash && line.dash !== "solid" ? line.dash.replaceAll("px", "") : "";
  for (const [key, x] of Object.entries({ x1: 0, x2: 26, y1: 4, y2: 4, stroke: line.color, "stroke-width": 2, "stroke-dasharray": dash })) stroke.setAttribute(key, x);
  svg.append(stroke);
  return svg;
}

function plot(figure) {
  if (!figure.chart) return;
  const [traces, how] = figure.chart.draw();
  const seen = new Map(traces.map((trace) => [trace.backend, { ...trace.line }]));
  figure.forward ??= new Set(seen.size > MANY ? FIRST : []);
  const some = [...seen.keys()].some((name) => figure.forward.has(name)); // none: all alike
  traces.sort((a, b) => figure.forward.has(a.backend) - figure.forward.has(b.backend));
  for (const trace of traces) {
    const forward = figure.forward.has(trace.backend);
    if (some && !forward) Object.assign(trace, { opacity: 0.35, line: { color: GREY, width: 1, dash: "solid" }, marker: { ...trace.marker, color: GREY } });
    if (forward) trace.line.width = 2.6;
    delete trace.backend;
  }
  const held = figure.contains(document.activeElement) ? document.activeElement.dataset.backend : null;
  figure.querySelector(".names").replaceChildren(...[...seen].map(([backend, line]) => node("button", { type: "button", "data-backend": backend, "aria-pressed": String(figure.forward.has(backend)),
    onclick: () => { if (!figure.forward.delete(backend)) figure.forward.add(backend); plot(figure); } }, sample(line), title(backend))));
  if (held) figure.querySelector(`[data-backend="${CSS.escape(held)}"]`)?.focus({ preventScroll: true });
  window.Plotly.react(figure.querySelector(".plot"), traces, how, { displayModeBar: false, responsive: true });
}
function recolour() { for (const figure of charts) plot(figure); }

async function startCharts(figure) {
  plotting ??= (async () => {
    curves = JSON.parse(await unpack("data-curves"));
    const address = URL.createObjectURL(new Blob([await unpack("data-plotly")], { type: "text/javascript" }));
    await new Promise((resolve, reject) => document.head.append(node("script", { src: address, onload: resolve, onerror: reject })));
    URL.revokeObjectURL(address);
  })();
  await plotting;
  const kind = figure.dataset.chart;
  figure.chart = kind === "error" || kind === "time" ? distribution(kind, figure) : kind === "ratio" ? ratio() : breakdown(kind, figure);
  figure.append(node("figcaption", {}, ...figure.chart.controls.filter(Boolean)), node("div", { class: "plot" }),
    node("div", { class: "names", role: "group", "aria-label": "Bring forward" }));
  charts.push(figure);
  plot(figure);
  figure.dataset.drawn = "true";
}
const near = new IntersectionObserver((entries) => {
  for (const entry of entries) if (entry.isIntersecting) { near.unobserve(entry.target); startCharts(entry.target); }
}, { rootMargin: "600px" });
for (const figure of document.querySelectorAll(".chart")) near.observe(figure);
addEventListener("beforeprint", () => { document.documentElement.dataset.theme = "light"; recolour(); });
addEventListener("afterprint", () => { setTheme(theme); recolour(); });

startCases();
})();
