// Tables that sort, and the choice of light or dark. Without this script a page lacks nothing else.
"use strict";
{
  const UNITS = { ms: 0.001, s: 1, min: 60, h: 3600, B: 1, kB: 1e3, MB: 1e6, GB: 1e9 };
  const NUMBER = /^\[?([-\u2212+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?)(?=$|[\s%,\]/\u00b0])/i;
  const words = new Intl.Collator("en", { numeric: true });

  // What a cell says as a number: "89.0 % [77, 95]" is 89, "3 of 5" is 0.6, "2 min 05 s" is 125, "never" without end; null is nothing said.
  function figure(text) {
    if (/^(|-|\u2013|n\/a\b.*)$/.test(text)) return null;
    if (/^never\b/.test(text)) return Infinity;
    const share = text.match(/^(\d+) of (\d+)/);
    if (share) return Number(share[2]) ? share[1] / share[2] : null;
    const units = [...text.matchAll(/([\d.]+(?:e[-+]?\d+)?) (ms|s|min|h|B|kB|MB|GB)\b/g)];
    if (units.length && units[0].index === 0) return units.reduce((sum, [, n, unit]) => sum + n * UNITS[unit], 0);
    const found = text.match(NUMBER);
    return found ? Number(found[1].replace("\u2212", "-")) : NaN;
  }

  // In an index the rows of a case are a body of their own, and move together.
  function groups(table) {
    return table.matches(".index") ? [...table.tBodies] : [...table.tBodies[0].rows];
  }

  function sort(written, column, order) {
    const cell = (group) => (group.rows ? group.rows[0] : group).cells[column].innerText.trim();
    const said = written.map((group) => ({ group, text: cell(group), value: figure(cell(group)) }));
    const numbers = said.every(({ value }) => value === null || !Number.isNaN(value));
    const sign = order === "descending" ? -1 : 1;
    const compare = (a, b) => {
      if (a.value === null || b.value === null) return (a.value === null) - (b.value === null);
      return sign * (numbers ? a.value - b.value : words.compare(a.text, b.text));
    };
    if (order !== "none") said.sort(compare);
    written[0].parentNode.append(...said.map(({ group }) => group));
  }

  const NEXT = { none: "ascending", ascending: "descending", descending: "none" };
  for (const table of document.querySelectorAll("table.sorts")) {
    const written = groups(table);
    const heads = [...table.tHead.rows[0].cells];
    heads.forEach((head, column) => {
      const button = document.createElement("button");
      button.type = "button";
      button.append(...head.childNodes);
      head.append(button);
      button.addEventListener("click", () => {
        const order = NEXT[head.getAttribute("aria-sort") ?? "none"];
        for (const other of heads) other.removeAttribute("aria-sort");
        if (order !== "none") head.setAttribute("aria-sort", order);
        sort(written, column, order);
      });
    });
  }

  // Who has no mouse scrolls with the arrow keys, once the box can be reached.
  for (const box of document.querySelectorAll(".scroll")) {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
  }

  const LOOKS = [["light dark", "as the system"], ["light", "light"], ["dark", "dark"]];
  const look = document.createElement("button");
  look.type = "button";
  look.className = "look";
  function show(number) {
    document.documentElement.style.colorScheme = LOOKS[number][0];
    look.textContent = `Colours: ${LOOKS[number][1]}`;
    look.value = number;
  }
  let kept = 0;
  try { kept = Number(localStorage.getItem("look")) % LOOKS.length || 0; } catch { /* a browser that keeps nothing */ }
  show(kept);
  look.addEventListener("click", () => {
    show((Number(look.value) + 1) % LOOKS.length);
    try { localStorage.setItem("look", look.value); } catch { /* as above */ }
  });
  document.body.prepend(look);
}
