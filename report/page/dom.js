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
// Three digits that matter, without a tail of zeros.
export function figure(x) {
  if (x === 0) return '0';
  const size = Math.abs(x);
  if (size >= 1e5 || size < 1e-3) return x.toExponential(1).replace('e+', 'e').replace('.0e', 'e');
  return String(Number(x.toPrecision(3)));
}
