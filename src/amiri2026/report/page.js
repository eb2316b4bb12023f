"use strict";
const form = document.querySelector(".filters");
if (form) {
  const sentences = [...document.querySelectorAll("article.sentence")];
  const show = () => {
    const kept = new Set([...form.querySelectorAll("input[type=checkbox]:checked")].map(box => box.dataset.verdict));
    const text = form.querySelector("input[type=search]").value.toLowerCase();
    let count = 0;
    for (const sentence of sentences) {
      sentence.hidden = !(kept.has(sentence.dataset.verdict) && sentence.textContent.toLowerCase().includes(text));
      if (!sentence.hidden) count += 1;
    }
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
