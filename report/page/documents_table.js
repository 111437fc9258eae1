// Tables of documents, which may be filtered by what stands in one of their columns.
import { count, element, icon, unbroken } from './dom.js';
import { nameNode, sourceNodes } from './sources.js';
import { exactWords, folded } from './verdicts.js';

const kLong = 40;  // letters of a cell that needs a wide column
export const byNumber = (isNumber) => (isNumber ? 'number' : null);

export function grid(given) {
  const rows = given.rows.map((row) => {
    const words = row.cells[given.filter];
    const cell = (text, k) => (k > 0 ? sourceNodes(text) : [icon(row.kind), row.kind === 'warn' && '! ', given.columns[0][0] === 'property' ? nameNode(text) : text]);
    const node = element('tr', { class: row.kind || null }, ...row.cells.map((text, k) => element(k === 0 ? 'th' : 'td', { scope: k === 0 ? 'row' : null, class: byNumber(given.columns[k][1]) || (text.length > kLong && k > 0 && 'long') }, ...cell(text, k))));
    return { node, words, isExact: row.kind === 'exact' };
  });
  const nodes = (isExact) => rows.filter((row) => row.isExact === isExact).map((row) => row.node);
  // Behind one row, unless somebody asks for some.
  const fold = nodes(true).length ? folded(nodes(true), exactWords(nodes(true).length), given.columns.length) : [];
  const shown = element('span', { class: 'muted small', role: 'status' });
  const values = given.filter < 0 ? [] : [...new Set(rows.map((row) => row.words))];
  const say = (n) => { shown.textContent = n === rows.length ? `${count(n)} ${n === 1 ? 'row' : 'rows'}` : `${count(n)} of ${count(rows.length)} rows`; };
  say(rows.length);
  const filter = values.length > 1 && element('label', {}, element('span', { text: `Show: ${given.columns[given.filter][0]}` }),
    element('select', { class: 'filter', onchange: (event) => {
      let n = 0;
      for (const row of rows) {
        row.node.hidden = event.target.value !== '' && row.words !== values[Number(event.target.value)];
        n += !row.node.hidden;
      }
      fold.forEach((part, k) => { part.hidden = (k === 0) === (event.target.value !== ''); });
      say(n);
    } }, element('option', { value: '', text: 'all' }), ...values.map((text, k) => element('option', { value: String(k), text: text || '–' }))));
  return element('section', { class: 'card' }, element('h3', { text: given.title }), given.words && element('p', { class: 'muted' }, ...unbroken(given.words)),
    element('div', { class: 'row' }, filter, shown),
    element('div', { class: 'scroll rows', tabindex: 0, role: 'region', 'aria-label': given.title }, element('table', {},
      element('thead', {}, element('tr', {}, ...given.columns.map(([text, isNumber]) => element('th', { scope: 'col', class: byNumber(isNumber), text })))),
      element('tbody', {}, ...nodes(false)), ...fold)),
    given.leftOut && element('p', { class: 'muted', text: given.leftOut }));
}
