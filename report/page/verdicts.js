// What fails, each with its witness; and a table of every property.
import { count, element, icon, plural, unbroken } from './dom.js';
import { hasPlace } from './marks.js';
import { nameNode, sourceNodes } from './sources.js';

const withUnit = (text, unit) => (unit ? `${text} ${unit}` : text);

export function command(text) {
  const code = element('code', { class: 'command', tabindex: 0 }, ...unbroken(text));
  const said = element('span', { class: 'muted', role: 'status' });
  const copy = element('button', { type: 'button', text: 'Copy', onclick: async () => {
    getSelection().selectAllChildren(code);
    try {
      await navigator.clipboard.writeText(text);
      said.textContent = 'Copied.';
    } catch {
      said.textContent = 'Selected: copy it with the keyboard.';
    }
  } });
  return element('div', { class: 'again' }, code, element('div', { class: 'row' }, copy, said));
}

const times = (ofBound) => (ofBound >= 100 ? ofBound.toExponential(1).replace('e+', 'e') : String(Number(ofBound.toPrecision(2))));

// Measured over bound: the bar ends at the bound, and what goes beyond is drawn beyond it.
function bar(row, fails) {
  if (row.ofBound === null) return element('span', { class: 'muted', text: row.bound === '0' && !fails ? 'exact' : '' });
  if (row.asksWider && !fails) return element('span', { class: 'muted', text: 'within the first of its bounds' });
  const share = Math.min(row.ofBound, 1.25);
  const filled = element('span', { class: fails ? 'filled bad' : 'filled' });
  filled.style.width = `${(100 * share) / 1.25}%`;
  const limit = element('span', { class: 'limit' });
  const text = row.ofBound >= 100 ? `${times(row.ofBound)} times the bound` : times(row.ofBound);
  return element('span', { class: 'measure' }, element('span', { class: 'bar', 'aria-hidden': 'true' }, filled, limit), element('span', { class: 'share', text }));
}

function statusOf(row, data) {
  if (row.failed > 0) return ['bad', 'fails'];
  if (row.expected > 0) return ['warn', '! fails, as expected'];
  if (row.judged === 0) return ['muted', data.foreign ? '– not judged' : '– nothing to look at'];
  return ['good', row.inconclusive > 0 ? 'holds, some within rounding' : 'holds'];
}

export const exactWords = (n) => `${plural(n, 'more row')}: exact, and ${n === 1 ? 'it holds' : 'they hold'}`;
const holds = (row) => row.judged > 0 && row.failed + row.expected === 0;
// It counts, and has no margin.
const isExact = (row) => holds(row) && row.bound === '0';

// Many rows of which none says more than the others, behind one that opens.
export function folded(rows, words, columns = 6) {
  const body = element('tbody', { hidden: true }, ...rows);
  const button = element('button', { type: 'button', class: 'quiet', 'aria-expanded': 'false', text: words, onclick: () => {
    body.hidden = !body.hidden;
    button.setAttribute('aria-expanded', String(!body.hidden));
  } });
  return [element('tbody', {}, element('tr', { class: 'fold' }, element('th', { scope: 'row', colspan: columns }, button))), body];
}

export function table(data, jump) {
  const shown = [], exact = [], ofJudging = [], others = [];
  for (const row of data.rows) {
    const [kind, words] = statusOf(row, data);
    const fails = row.failed + row.expected > 0;
    const details = [];
    if (row.failed > 0 && data.foreign && row.judged === 1) details.push('its first failure is shown');
    else if (row.failed > 0) details.push(`${count(row.failed)} of ${plural(row.judged, 'verdict')} fail`);
    else if (row.expected > 0) details.push(`${count(row.expected)} of ${plural(row.judged, 'verdict')} fail, which the scene expects`);
    else if (row.judged > 0) details.push(data.foreign ? `${count(row.checked)} looked at` : plural(row.judged, 'verdict'));
    else details.push(row.vacuous || 'there was nothing to look at');
    if (row.inconclusive > 0) details.push(`${plural(row.inconclusive, 'thing')} inconclusive within rounding, counted as right`);
    (holds(row) && row.ofJudging ? ofJudging : isExact(row) ? exact : row.judged > 0 ? shown : others).push(element('tr', { class: fails ? kind : null },
      element('th', { scope: 'row' }, nameNode(row.property, data.command), !data.foreign && element('span', { class: 'muted small', text: ` after ${row.stage}` })),
      element('td', {}, element('span', { class: `status ${kind}` }, icon(kind), element('span', { text: words })), element("span", { class: "muted small block", text: details.join('; ') })),
      element('td', {}, row.judged > 0 && bar(row, fails)),
      element('td', { class: 'figures' }, row.judged > 0 && element('span', { text: withUnit(row.measured, row.unit) }), row.judged > 0 && element('span', { class: 'muted small block', text: `bound ${withUnit(row.bound, row.unit)}` })),
      element('td', {}, row.judged > 0 && data.moments.length > 1 && element('button', { type: 'button', class: 'quiet', text: `frame ${row.frame}`, 'aria-label': `Show frame ${row.frame}${data.foreign ? '' : `, after ${row.stage}`}: ${fails ? 'where' : 'the nearest to the bound of'} ${row.property}${fails ? ' fails first' : ''}`, onclick: () => jump(row.frame, row.stage) })),
      element('td', { class: 'muted small' }, ...sourceNodes(row.source))));
  }
  const head = ['Property', 'Result', 'Measured / bound', 'Measured', fails(data) ? 'First failure, or nearest to the bound' : 'Nearest to the bound', 'Where the bound comes from'];
  return element('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Every property' }, element('table', { class: 'verdicts' },
    element('thead', {}, element('tr', {}, ...head.map((text) => element('th', { scope: 'col', text })))), element('tbody', {}, ...shown),
    ...(exact.length ? folded(exact, exactWords(exact.length)) : []),
    ...(ofJudging.length ? folded(ofJudging, `${plural(ofJudging.length, 'check')} of the judging itself: ${ofJudging.length === 1 ? 'it holds' : 'they hold'}`) : []),
    ...(others.length ? folded(others, `${plural(others.length, 'property', 'properties')} ${data.foreign ? 'not judged' : 'with nothing to look at'}`) : [])));
}

const fails = (data) => data.rows.some((row) => row.failed + row.expected > 0);

// The witness of somebody else's run counts what is wrong.
function figuresOf({ measured, bound, unit, ofBound, marks }, isForeign) {
  if (measured === 'nothing') return '';
  const isCount = bound === '0' && !unit, said = [];
  if (!isCount) said.push(`Measured: ${withUnit(measured, unit)}`);
  else if (!isForeign) said.push(`Counted: ${measured}`);
  said.push(bound === '0' ? 'never allowed (bound 0)' : ofBound === null ? `bound ${withUnit(bound, unit)}` : `${times(ofBound)} times the bound of ${withUnit(bound, unit)}`);
  const text = `${said.join(', ')}. `;
  return `${text[0].toUpperCase()}${text.slice(1)}${isForeign && unit && !hasPlace(marks) ? 'It concerns the whole body. ' : ''}`;
}

// One card for each property and stage that fails, with its first witness; its later ones behind it.
export function cards(data, show) {
  const groups = new Map(), isLone = data.moments.length < 2;  // a state has no frames
  data.findings.forEach((finding, k) => {
    const key = `${finding.property}\n${finding.stage}`;
    if (!groups.has(key)) groups.set(key, []);
    groups.get(key).push(k);
  });
  const found = [];
  for (const members of groups.values()) {
    const first = data.findings[members[0]];
    const button = (k, text) => element('button', { type: 'button', class: 'finding', 'data-finding': k, 'aria-pressed': 'false', text, onclick: () => show(k) });
    const row = data.rows.find((one) => one.property === first.property && one.stage === first.stage);
    const text = element('p', { class: 'witness' }, ...unbroken(`${first.text || 'It has no witness.'}${data.foreign && first.text ? '.' : ''}`));
    found.push(element('article', { class: `card ${first.expected ? 'warn' : 'bad'}` },
      element('h3', {}, nameNode(first.property, data.command), !data.foreign && element('span', { class: 'muted', text: ` after ${first.stage}` })),
      text,
      element('p', { class: 'muted small' }, element('span', { text: figuresOf(first, data.foreign) }),
        element('span', { text: row && row.failed + row.expected > 1 ? `It fails in ${count(row.failed + row.expected)} of ${plural(row.judged, 'verdict')}.` : '' }),
        first.expected && element('span', { text: ' The scene expects it to fail.' })),
      element('div', { class: 'row' }, button(members[0], isLone ? 'Show me' : hasPlace(first.marks) ? `Show me: frame ${first.frame}` : `Go to frame ${first.frame}`)),
      members.length > 1 && element('details', {}, element('summary', { text: `Again in ${plural(members.length - 1, 'later verdict')}` }),
        element('ul', { class: 'again-in' }, ...members.slice(1).map((k) => element('li', {}, button(k, `frame ${data.findings[k].frame}`), element('span', { class: 'small', text: ` ${data.findings[k].text}` })))))));
  }
  return found;
}
