"use strict";
// Theme, and the rows of a table that hold all the words of a search. Text only ever becomes text nodes.
(() => {
const themes = ["system", "light", "dark"], button = document.getElementById("theme");
let theme = "system";
function setTheme(name) {
  theme = themes.includes(name) ? name : "system";
  if (theme === "system") delete document.documentElement.dataset.theme;
  else document.documentElement.dataset.theme = theme;
  button.textContent = `Theme: ${theme}`;
}
try { setTheme(localStorage.getItem("theme")); } catch { /* storage is closed to this page */ }
button.addEventListener("click", () => {
  setTheme(themes[(themes.indexOf(theme) + 1) % 3]);
  try { localStorage.setItem("theme", theme); } catch { /* the choice lasts as long as the page */ }
});
addEventListener("beforeprint", () => { document.documentElement.dataset.theme = "light"; });
addEventListener("afterprint", () => setTheme(theme));

for (const input of document.querySelectorAll("input[data-rows]")) {
  const rows = [...document.querySelectorAll(`#${input.dataset.rows} tbody tr`)];
  const texts = rows.map((row) => row.innerText.toLowerCase());
  const output = input.closest("p").querySelector("output");
  input.addEventListener("input", () => {
    const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
    let shown = 0;
    rows.forEach((row, i) => {
      row.hidden = !words.every((word) => texts[i].includes(word));
      shown += !row.hidden;
    });
    output.textContent = words.length ? `${shown} of ${rows.length} rows` : "";
  });
}
document.documentElement.dataset.ready = "";
})();
