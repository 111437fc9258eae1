// The page of documents that are no run: campaigns, measurements, counterexamples.
import { chart, stack } from './charts.js';
import { grid } from './documents_table.js';
import { badge, byId, count, element, madeFacts, plural, sayMade, unbroken } from './dom.js';
import { Sceneries } from './scenery.js';
import { sourceNodes } from './sources.js';
import { command } from './verdicts.js';

const make = { chart, stack, grid };
const statusKind = (holds) => (holds === null ? 'muted' : holds ? 'good' : 'bad');
const badgeOf = (sheet) => badge(statusKind(sheet.holds), sheet.badge);

function card(given, sceneries, number) {
  const id = `card-${number}`;
  return element('article', { class: 'card bad failure', 'aria-labelledby': id },
    element('h3', { id, text: given.title }),
    given.words && element('p', { class: 'witness', text: given.words }),
    element('dl', {}, ...given.facts.flatMap(([what, value]) => [element('dt', { text: what }), element('dd', {}, ...sourceNodes(value))])),
    sceneries && given.picture >= 0 && element('div', { class: 'row' }, element('button', { type: 'button', class: 'finding', 'data-scenery': given.picture, 'aria-pressed': 'false', text: 'Show me', onclick: (event) => {
      for (const other of document.querySelectorAll('[data-scenery]')) other.setAttribute('aria-pressed', String(other === event.currentTarget));
      sceneries.show(given.picture);
      byId('view').scrollIntoView({ block: 'nearest' });
    } })),
    given.command && element('h4', { text: 'See it again' }), given.command && command(given.command));
}

function failures(sheet, sceneries, first) {
  const section = element('section', { class: 'card failures' }, element('h2', { text: sheet.cards.length ? (sheet.holds === false ? 'What fails' : sheet.kind === 'counterexample' || sheet.kind === 'counterexamples' ? 'What failed once' : 'What fails') : 'Nothing fails' }));
  section.append(...sheet.cards.map((one, k) => card(one, sceneries, first + k)));
  if (sheet.cardsLeftOut > 0) section.append(element('p', { class: 'muted', text: `${plural(sheet.cardsLeftOut, 'other failure')} are in the document, and not shown.` }));
  return section;
}

// A sheet whose page shows others too has a heading of its own.
function put(main, sheet, isAlone, sceneries, first) {
  if (!isAlone) main.append(element('header', { class: 'sheet' }, element('h2', { class: 'sheet-title', text: `${sheet.kind}: ${sheet.title}` }), element('p', {}, badgeOf(sheet), element('span', { text: sheet.summary })), element('p', { class: 'muted', text: [...sheet.facts, ...(sheet.made ? madeFacts(sheet.made) : [])].join(' · ') })));
  const judges = sheet.kind === 'campaign' || sheet.kind === 'judged plugin';
  const isPictured = sceneries && sheet.cards.some((one) => one.picture >= 0);
  if (sheet.cards.length) {
    const cards = failures(sheet, sceneries, first);
    const holder = isPictured && !sceneries.isPlaced ? element('div', { class: 'stage' }, sceneries.section, cards) : cards;
    if (isPictured) sceneries.isPlaced = true;
    main.append(holder);
  } else if (judges && sheet.holds) {  // where it does not hold, the summary has said so
    main.append(element('section', { class: 'card failures' }, element('h2', { text: 'Nothing fails' }), element('p', { text: `${sheet.kind === 'campaign' ? 'No case of this campaign violates' : 'No question showed a violation of'} any property. That says nothing about cases that it did not draw: another seed draws others.` })));
  }
  if (sheet.again || sheet.notes.length) {
    main.append(element('section', { class: 'card notes-card' }, sheet.again && element('h2', { text: 'Repeat it' }), sheet.again && command(sheet.again),
      sheet.notes.length > 0 && element('h2', { text: 'Good to know' }), sheet.notes.length > 0 && element('ul', { class: 'notes' }, ...sheet.notes.map((text) => element('li', {}, ...unbroken(text))))));
  }
  let plots = null;
  for (const piece of sheet.pieces) {
    const node = make[piece.kind](piece);
    if (piece.kind === 'grid') {
      plots = null;
      main.append(node);
      continue;
    }
    if (!plots) main.append(plots = element('div', { class: 'grid plots' }));
    plots.append(node);
  }
}

export async function showDocuments(data) {
  const { sheets } = data;
  const [first] = sheets;
  const isAlone = sheets.length === 1;
  const worst = sheets.some((one) => one.holds === false) ? false : sheets.some((one) => one.holds) ? true : null;
  document.title = `${worst === null ? '' : worst ? 'Holds: ' : 'Fails: '}${first.title} · cutproof report`;
  byId('title').textContent = isAlone || sheets.slice(1).every((one) => one.kind === 'campaign') ? `${first.kind[0].toUpperCase()}${first.kind.slice(1)}: ${first.title}` : plural(sheets.length, first.kind);
  byId('summary').append(...(isAlone ? [badgeOf(first), element('span', { text: first.summary })] : [element('span', { text: worst === null ? '' : worst ? 'Everything on this page holds.' : 'Not everything on this page holds.' })]));
  byId('facts').textContent = isAlone ? first.facts.filter((fact) => fact !== `cutproof ${data.made.program}`).join(' · ') : '';
  sayMade((isAlone && first.made) || data.made);
  const skip = document.querySelector('.skip');
  skip.remove();
  const main = document.querySelector('main');
  main.replaceChildren();
  const sceneries = data.sceneries.length ? new Sceneries(data.sceneries) : null;
  let cards = 0;
  for (const sheet of sheets) {
    put(main, sheet, isAlone, sceneries, cards);
    cards += sheet.cards.length;
  }
  const about = ['It needs no network. Whatever a plot shows stands in a table, too; figures are rounded to three or four digits, the document has all of them.'];
  if (sceneries) about.unshift(`The 3D view shows ${count(data.sceneries.length)} ${data.sceneries.length === 1 ? 'counterexample' : 'counterexamples'}, each run again when this page was made. Lengths are in h, the spacing of particles. In a view arrows turn, with Shift they shift; + and − zoom, 0 shows the whole body.`);
  main.append(element('section', { id: 'about', class: 'card' }, element('h2', { text: 'About this page' }), ...about.map((text) => element('p', { text }))));
  if (sceneries && sceneries.isPlaced) {
    const button = document.querySelector('[data-scenery="0"]');
    if (button) button.setAttribute('aria-pressed', 'true');
    await sceneries.show(0);
  }
  document.documentElement.dataset.ready = 'true';
}
