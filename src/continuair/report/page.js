"use strict";
const form = document.querySelector(".filters");
if (form) {
  const rows = [...document.querySelectorAll("#verdicts tbody tr")];
  const show = () => {
    const kept = new Set([...form.querySelectorAll("input[type=checkbox]:checked")].map(box => box.dataset.verdict));
    const part = form.querySelector("select").value;
    const text = form.querySelector("input[type=search]").value.toLowerCase();
    const parts = new Set();
    let count = 0;
    for (const row of rows) {
      if (row.classList.contains("part")) continue;
      row.hidden = !(kept.has(row.dataset.verdict) && (!part || row.dataset.part === part)
        && row.textContent.toLowerCase().includes(text));
      if (!row.hidden) { parts.add(row.dataset.part); count += 1; }
    }
    for (const row of rows) if (row.classList.contains("part")) row.hidden = !parts.has(row.dataset.part);
    form.querySelector("output").textContent = `${count} shown`;
  };
  form.addEventListener("input", show);
  form.addEventListener("submit", event => event.preventDefault());
  show();
}
// On paper everything is unfolded.
let folded = [];
addEventListener("beforeprint", () => {
  folded = [...document.querySelectorAll("details:not([open])")];
  folded.forEach(each => { each.open = true; });
});
addEventListener("afterprint", () => folded.forEach(each => { each.open = false; }));
