// What a property demands, and where its bound comes from: in the words of the documentation, which a page holds, so
// that whoever has the page alone can read them.
import method from '../../docs/design/method.md';
import tolerances from '../../docs/design/tolerances.md';
import oracles from '../../docs/reference/oracles.md';
import { byId, element } from './dom.js';

const pages = { 'method.md': method, 'tolerances.md': tolerances, 'oracles.md': oracles };

// --- Sections

// Of a page: the lines of the section whose heading begins so, with those below it; null if there is none.
function sectionOf(page, begin) {
  const lines = pages[page].split('\n').filter((line) => !line.startsWith('<!--'));
  const level = (line) => (line.match(/^#+(?= )/) || [''])[0].length;
  const first = lines.findIndex((line) => level(line) > 1 && line.replace(/^#+ /, '').toLowerCase().startsWith(begin.toLowerCase()));
  if (first < 0) return null;
  const next = lines.findIndex((line, k) => k > first && level(line) > 0 && level(line) <= level(lines[first]));
  return lines.slice(first, next < 0 ? lines.length : next);
}

const plain = (text) => text.replace(/\[([^\]]*)\]\([^)]*\)/g, '$1').replace(/\*\*|`/g, '').replace(/(^|\W)\*(?=\S)([^*]+)\*/g, '$1$2').replace(/\\(.)/g, '$1');
const cellsOf = (line) => line.slice(1, line.lastIndexOf('|')).split(/(?<!\\)\|/).map((cell) => plain(cell.trim()));

// What these pages are written with: headings, tables, lists, code and paragraphs.
function rendered(lines) {
  const nodes = [];
  let last = null, isCode = false;  // a list, table or block that goes on
  const goOn = (tag) => { if (!last || last.tagName !== tag.toUpperCase()) nodes.push(last = element(tag)); return last; };
  for (const line of lines) {
    if (/^```/.test(line)) isCode = !isCode;
    else if (isCode) goOn('pre').append(`${line}\n`);
    else if (/^#/.test(line)) nodes.push(last = element('h3', { text: plain(line.replace(/^#+ /, '')) }));
    else if (/^\|[-| :]+$/.test(line)) continue;
    else if (/^\|/.test(line)) goOn('table').append(element('tr', {}, ...cellsOf(line).map((text) => element('td', { text }))));
    else if (/^ {4}/.test(line)) goOn('pre').append(`${line.slice(4)}\n`);
    else if (/^ *(- |\d+\. )/.test(line)) goOn('ul').append(element('li', { text: plain(line.replace(/^ *(- |\d+\. )/, '')) }));
    else if (line.trim()) nodes.push(last = element('p', { text: plain(line) }));
    else last = null;
  }
  return nodes;
}

function openSection(page, begin) {
  const close = element('button', { type: 'button', text: 'Close', onclick: () => dialog.close() });
  const dialog = element('dialog', { id: 'section', 'aria-label': `${page}, ${begin}`, onclose: () => dialog.remove() },
    element('div', { class: 'row' }, element('span', { class: 'muted', text: page }), close), ...rendered(sectionOf(page, begin)));
  document.body.append(dialog);
  dialog.showModal();
}

// The section that a link names, if it names one.
export function openLinked(link) {
  const [page, begin] = (link.get('section') || '').split('/');
  if (pages[page] && sectionOf(page, begin)) openSection(page, begin);
}

// Where a bound comes from, with titles of sections; each is a link to its text.
export function sourceNodes(source) {
  const nodes = [];
  let at = 0;
  for (const found of source.matchAll(/(?:docs\/\w+\/)?(method\.md|tolerances\.md|oracles\.md)(?: §(\d+)|, ([A-Z][^;:]*))/g)) {
    const [all, page, number, title] = found, begin = number ? `${number}.` : title;
    const lines = sectionOf(page, begin);
    if (!lines) continue;
    const heading = lines[0].replace(/^#+ (\d+\. )?| \(.*\)$/g, '');
    nodes.push(source.slice(at, found.index), element('a', { href: `#${new URLSearchParams({ section: `${page}/${begin}` })}`, text: number ? `${page} §${number} (${heading})` : all, onclick: (event) => { event.preventDefault(); openSection(page, begin); } }));
    at = found.index + all.length;
  }
  return [...nodes, source.slice(at)];
}

// --- Properties

// Of each section of oracles.md the first sentence on each property; of a name in several, a page's own section counts.
const kOwn = { run: 'A whole run', check: 'A whole run', check_run: 'A run of any simulator', check_state: 'A state from a file', kick: 'A kick', relate: 'Two runs that correspond' };
let known = null;
function sentences() {
  if (known) return known;
  known = {};
  let section = null;
  const add = (names, text) => {
    const sentence = plain(text).split(/(?<=[^.])\. (?=[A-Z])|(?:^|\. )measured/)[0].replace(/[;.]$/, '');
    if (sentence) for (const name of names.split(', ')) section[name] = sentence;
  };
  for (const line of oracles.split('\n')) {
    const bullet = line.match(/^- \*\*([^*]+)\*\*(?: is added)?[^:]*: (.*)/);
    if (/^## /.test(line)) section = known[line.slice(3)] = {};
    else if (section && /^\| /.test(line)) { const [names, text] = cellsOf(line); add(names, text); }
    else if (section && bullet) add(bullet[1], bullet[2]);
  }
  return known;
}

export function explained(property, command) {
  const all = sentences(), own = all[kOwn[command]] || {};
  const name = property.replace(/^(expected|the reference's|lockstep:|free-running:) .*/, '$1 …');
  const text = own[name] || (Object.values(all).find((section) => section[name]) || {})[name];
  return text ? `${text[0].toUpperCase()}${text.slice(1)}.` : '';
}

// A property's name, explained where a mouse or the keyboard comes to it.
export function nameNode(property, command) {
  const text = explained(property, command);
  if (!text) return element('span', { text: property });
  const node = element('span', { class: 'explained', tabindex: 0, 'aria-describedby': 'explanation', text: property });
  const show = () => {
    const tip = byId('explanation') || document.body.appendChild(element('div', { id: 'explanation', role: 'tooltip' }));
    tip.textContent = text;
    tip.hidden = false;
    const box = node.getBoundingClientRect(), size = tip.getBoundingClientRect();
    tip.style.left = `${Math.max(8, Math.min(box.left, innerWidth - size.width - 8))}px`;
    tip.style.top = `${box.bottom + size.height + 8 > innerHeight ? box.top - size.height - 4 : box.bottom + 4}px`;
  };
  const hide = () => { if (byId('explanation')) byId('explanation').hidden = true; };
  for (const [event, what] of [['pointerenter', show], ['focus', show], ['pointerleave', hide], ['blur', hide], ['keydown', (one) => { if (one.key === 'Escape') hide(); }]]) node.addEventListener(event, what);
  return node;
}
