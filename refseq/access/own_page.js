// What pages of ours share: asking, making elements, telling mistakes. No text ever becomes markup.
"use strict";

const SVG = "http://www.w3.org/2000/svg";

/** The element with this id. */
const at = (id) => document.getElementById(id);

/** Make an element: properties, listeners (onclick), attributes (others), and children. */
function make(name, given = {}, ...children) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(given)) {
    if (key in made) made[key] = value; else made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

/** Make an element of a drawing. */
function draw(name, given = {}) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(given)) made.setAttribute(key, value);
  return made;
}

/** Ask; throws an Error with the line that tells a mistake. */
async function ask(path, told) {
  const options = told === undefined ? {} : { method: "POST", body: JSON.stringify(told) };
  const answer = await fetch(path, { ...options, cache: "no-store" });
  const text = await answer.text();
  let found;
  try { found = JSON.parse(text); } catch { throw new Error(text.trim() || `no answer (${answer.status})`); }
  if (!answer.ok) throw new Error(found.error);
  return found;
}
