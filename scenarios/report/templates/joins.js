// Decide about joins by keyboard, and save the decisions as the file that merging reads.
"use strict";
{
  const joins = [...document.querySelectorAll(".join")];
  const save = document.getElementById("save"), count = document.getElementById("count");
  const answers = new Map();
  let at = 0;

  function text() {
    const tables = joins.filter((one) => answers.has(one)).map((one) => {
      return "[[join]]\n" + one.dataset.toml + "joined = " + answers.get(one) + "\n";
    });
    return "# Joins that a person decided about on the page of refseq map merge.\n\n" + tables.join("\n");
  }

  function show() {
    joins.forEach((one, n) => {
      one.setAttribute("aria-current", n === at);
      for (const button of one.querySelectorAll("button")) {
        button.setAttribute("aria-pressed", String(answers.get(one)) === button.dataset.answer);
      }
    });
    count.value = answers.size ? answers.size + " of " + joins.length + " decided" : "none yet";
    save.href = "data:application/toml;charset=utf-8," + encodeURIComponent(text());
  }

  function go(to) {
    at = Math.max(0, Math.min(joins.length - 1, to));
    show();
    joins[at]?.scrollIntoView({ block: "start" });
    window.scrollBy(0, -document.getElementById("bar").offsetHeight);
  }

  function answer(one, word) {
    if (word === null) answers.delete(one);
    else answers.set(one, word);
    show();
  }

  const keys = {
    ArrowDown: () => go(at + 1), ArrowUp: () => go(at - 1), s: () => save.click(),
    z: () => { document.body.classList.toggle("large"); go(at); },
    j: () => answer(joins[at], true), r: () => answer(joins[at], false), u: () => answer(joins[at], null),
  };
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || !keys[event.key] || !joins.length) return;
    event.preventDefault();
    keys[event.key]();
  });
  joins.forEach((one, n) => one.addEventListener("click", (event) => {
    at = n;
    const word = event.target.dataset.answer;
    if (word) answer(one, word === "true");
    show();
  }));
  show();
}
