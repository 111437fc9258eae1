// Elements. Texts get into the page by textContent alone: whatever a file calls itself, it is shown and never run.

function put(node, options, children) {
  for (const [name, value] of Object.entries(options || {})) {
    if (value === undefined || value === null || value === false) continue;
    if (name === 'text') node.textContent = value;
    else if (name.startsWith('on')) node.addEventListener(name.slice(2), value);
    else node.setAttribute(name, value === true ? '' : value);
  }
  for (const child of children) if (child) node.append(child);
  return node;
}

export const element = (tag, options, ...children) => put(document.createElement(tag), options, children);
export const drawing = (tag, options, ...children) =>
  put(document.createElementNS('http://www.w3.org/2000/svg', tag), options, children);
export const byId = (id) => document.getElementById(id);

export const count = (n) => n.toLocaleString('en-US');
export const plural = (n, one, many) => `${count(n)} ${n === 1 ? one : many || one + 's'}`;
export const madeFacts = ({ program, date, machine, commit }) => [date, machine, commit && `commit ${commit}`, `cutproof ${program}`].filter(Boolean);
// When, where and by which command what a page shows was made.
export function sayMade(made) {
  byId('made').append(element('span', { text: `Made ${madeFacts(made).join(' · ')}` }), made.command && ' · ', made.command && element('code', {}, ...unbroken(made.command)));
}
// Parts of a text: no option and no number breaks behind its dashes.
export const unbroken = (text) => text.split(/((?<![\w-])--?[a-z][\w-]*|[\d.]+e-\d+)/).map((part, k) => (k % 2 ? element('span', { class: 'whole', text: part }) : part)).filter(Boolean);
// Three digits that matter, without a tail of zeros.
export function figure(x) {
  if (x === 0) return '0';
  const size = Math.abs(x);
  if (size >= 1e5 || size < 1e-3) return x.toExponential(1).replace('e+', 'e').replace('.0e', 'e');
  return String(Number(x.toPrecision(3)));
}

// Drawn, because a machine with few fonts lacks their letters.
const kIcons = { play: 'M3 1.5v13l11-6.5z', pause: 'M3 2h4v12h-4zM9 2h4v12h-4z', good: 'M1.5 8.5l2-2 3 3 6-7 2 2-8 9.5z', bad: 'M3.5 1.5l4.5 4.5 4.5-4.5 2 2-4.5 4.5 4.5 4.5-2 2-4.5-4.5-4.5 4.5-2-2 4.5-4.5-4.5-4.5z' };
export const icon = (name) => kIcons[name] && drawing('svg', { class: 'icon', viewBox: '0 0 16 16', 'aria-hidden': 'true' }, drawing('path', { d: kIcons[name] }));
export const badge = (kind, text) => element('span', { class: `badge ${kind}` }, icon(kind), element('span', { text }));
