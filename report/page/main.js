// The page: reads its data, puts them together, and keeps view, player, verdicts and plots at the same moment.
import { Moments } from './coding.js';
import { colourings, rampStops } from './colours.js';
import { apartInWords, comparisonCard } from './compare.js';
import { showDocuments } from './documents.js';
import { badge, byId, count, drawing, element, figure, icon, plural, sayMade, unbroken } from './dom.js';
import { hasPlace, markedWords, marksOf } from './marks.js';
import { plotsOf } from './plots.js';
import { openLinked } from './sources.js';
import { cards, command, table } from './verdicts.js';
import { View, contextOf } from './view.js';

const data = JSON.parse(byId('data').textContent);
// A page of documents has no moments of its own.
const moments = new Moments(data.firstMoment || []);
const comparison = data.comparison;
const besides = comparison && comparison.shown ? new Moments(data.besideFirst, 'beside') : null;
const sideNames = besides ? [comparison.ownName, comparison.name] : [];
const last = (data.moments || []).length - 1;
const kFramesPerSecond = 15;
// Failures of a run that the colours of what is coupled show.
const kOfCoupling = ['no coupling across pieces', 'pieces coupled within', 'pieces as said'];
const hasGroups = Boolean(data.frames) && data.frames.clusters.some((n) => n > 0);

// spot: a particle that is marked where no verdict names any, by its place on the page.
const state = { at: 0, finding: null, isPlaying: false, spot: null };
let view = null, edges = null, plots = [], shown = 0, colours = null;

// Frames of somebody else's run have no stages, nor have those of a scene that has not run; a state has no frames.
const isPreview = data.command === 'preview', hasStages = !data.foreign && !isPreview;
const words = (moment) => (data.command === 'check_state' ? 'The state' : moment.start ? 'As loaded' : !hasStages ? `Frame ${moment.frame}` : `Frame ${moment.frame}, after ${moment.stage}`);

function header() {
  const name = data.scene || 'a recording';
  document.title = `${data.checked ? (data.holds ? 'Holds: ' : 'Fails: ') : ''}${name} · cutproof report`;
  byId('title').textContent = name;
  const kind = !data.checked ? 'muted' : data.holds ? 'good' : 'bad';
  byId('summary').append(badge(kind, !data.checked ? 'not judged' : data.holds ? 'holds' : 'fails'), element('span', { text: data.summary }));
  const hasFrames = data.command !== 'check_state' && !isPreview;
  // Of somebody else's run there may be more from frame to frame.
  const [begins, ends] = data.foreign ? [data.frames.particles[0], data.frames.particles[data.frames.particles.length - 1]] : [];
  const facts = [begins === ends ? plural(data.body.particles, 'particle') : `${plural(begins, 'particle')} at first, ${count(ends)} at the end`, `h = ${figure(1e3 * data.body.spacing)} mm`, hasFrames && plural(data.frames.frame.filter((frame) => frame >= 0).length, 'frame')].filter(Boolean);
  if (data.checked) facts.push(plural(data.verdicts, 'verdict'));
  if (data.judgedBy && data.judgedBy !== data.made.program) facts.push(`judged by cutproof ${data.judgedBy}`);
  byId('facts').textContent = facts.join(' · ');
  sayMade(data.made);
}

// --- The view and its player

const look = { skin: true, particles: false, removed: false, way: true, colouring: null };
const canvas = element('canvas', { id: 'canvas', tabindex: 0, role: 'application', 'aria-label': '3D view. Arrow keys turn it, plus and minus come nearer and go away, 0 goes back; space plays, comma and full stop go back and on. C cuts the body open; brackets move the cut, Alt with arrows turns it.' });
const status = element('p', { id: 'status' });
const witness = element('p', { id: 'witness', role: 'status' });
const legend = element('p', { id: 'legend', class: 'small' });
const range = element('input', { type: 'range', id: 'scrub', min: 0, max: last, step: 1, value: 0, 'aria-label': 'Moment of the run' });
const play = element('button', { type: 'button', id: 'play' }, icon('play'), element('span', { text: 'Play' }));

const frameOf = (k) => (data.moments[k].start ? -1 : data.moments[k].frame);
const isEnd = (k) => k === last || frameOf(k + 1) !== frameOf(k);
function nextFrame(k, by) {
  let next = k + by;
  while (next > 0 && next < last && !isEnd(next)) next += by;
  return Math.min(Math.max(next, 0), last);
}

// Whether a property of a run fails in a frame.
function failsIn({ frames }, frame) {
  return frames.some((from, k) => k % 2 === 0 && from <= frame && frame <= frames[k + 1]);
}

function timeline() {
  const svg = drawing('svg', { class: 'timeline', viewBox: '0 0 1000 14', preserveAspectRatio: 'none', 'aria-hidden': 'true' });
  const x = (k) => (last ? (1000 * k) / last : 0);
  const mark = (k, kind, y, height) => svg.append(drawing('rect', { class: kind, x: x(k) - 1.5, width: 3, y, height }));
  data.moments.forEach((moment, k) => { if (moment.removed > 0 && isEnd(k)) mark(k, 'cut', 9, 5); });
  for (const finding of data.findings) {
    const kind = finding.expected ? 'warn' : 'bad';
    if (finding.marks.moment >= 0) mark(finding.marks.moment, kind, 0, 8);
    for (let k = 0; k < finding.frames.length; k += 2) {
      const [from, to] = [finding.frames[k], finding.frames[k + 1]].map((frame) => x(momentOf(frame, 'skin')));
      svg.append(drawing('rect', { class: kind, x: from - 1.5, width: to - from + 3, y: 0, height: 4 }));
    }
  }
  const keys = [];
  if (data.findings.some((f) => !f.expected)) keys.push(['bad', data.foreign ? 'a property fails; high: first' : 'a verdict fails']);
  if (data.findings.some((f) => f.expected)) keys.push(['warn', 'fails as expected']);
  if (data.moments.some((m) => m.removed > 0)) keys.push(['cut', 'particles are removed']);
  if (data.foreign) {
    data.moments.forEach((moment, k) => { if (moment.swept.length && !(moment.removed > 0)) mark(k, 'cut', 9, 5); });
    if (data.moments.some((m) => m.swept.length)) keys.push(['cut', 'the blade moves']);
  }
  const legendOfIt = element('ul', { class: 'legend' }, ...keys.map(([kind, text]) => element('li', {}, element('span', { class: `key ${kind}` }), element('span', { text }))));
  return [svg, legendOfIt];
}

function controls() {
  if (last === 0) return '';
  const button = (text, name, onclick) => element('button', { type: 'button', text, 'aria-label': name, title: name, onclick });
  play.addEventListener('click', () => setPlaying(!state.isPlaying));
  range.addEventListener('input', () => { setPlaying(false); if (view) view.hurry(); go(Number(range.value)); });
  const step = (by) => () => { setPlaying(false); go(state.at + by); };
  const frame = (by) => () => { setPlaying(false); go(nextFrame(state.at, by)); };
  const [marks, keys] = timeline();
  return element('div', { class: 'player' },
    element('div', { class: 'track' }, marks, range),
    element('div', { class: 'row' }, play, button('« Frame', 'Previous frame', frame(-1)), hasStages && button('‹ Stage', 'Previous stage', step(-1)), hasStages && button('Stage ›', 'Next stage', step(1)), button('Frame »', 'Next frame', frame(1)), keys));
}

function lookControls(hasSkin) {
  const all = colourings(Boolean(edges) && data.body.onGrid, comparison, { ...data, hasGroups });
  colours = all;
  // Of two runs of somebody else's it is asked how far they are apart.
  look.colouring = (data.foreign && all.apart) || all.piece || all.cluster || all.displacement;
  // The skin of somebody else's run says nothing of particles.
  look.skin = hasSkin && !data.foreign;
  look.particles = !look.skin;
  const select = (label, id, options, onchange) => element('label', {}, element('span', { text: label }), element('select', { id, onchange: (event) => { onchange(event.target.value); update(); } }, ...options.map(([value, text, selected]) => element('option', { value, text, selected }))));
  const shows = [['skin', 'skin'], ['particles', 'particles'], ['both', 'both']];
  return element('div', { class: 'row looks' },
    hasSkin && select('Show', 'show', data.foreign ? [shows[1], shows[0], shows[2]] : shows, (value) => { look.skin = value !== 'particles'; look.particles = value !== 'skin'; }),
    select('Colour', 'colour', Object.entries(all).map(([key, one]) => [key, one.name, one === look.colouring]), (value) => { look.colouring = all[value]; }),
    view.sides[0].hasWay() && element('label', {}, element('input', { type: 'checkbox', id: 'way', checked: true, onchange: (event) => { look.way = event.target.checked; update(); } }), element('span', { text: 'blade’s way' })),
    element('label', {}, element('input', { type: 'checkbox', id: 'removed', onchange: (event) => { look.removed = event.target.checked; update(); } }), element('span', { text: 'removed' })),
    ...view.plane.controls(view.orbit),
    element('button', { type: 'button', class: 'quiet', text: 'Whole body', onclick: () => view.orbit.goHome() }));
}

function setPlaying(isPlaying) {
  if (isPlaying && state.at === last) go(firstSkinned());
  state.isPlaying = isPlaying;
  play.replaceChildren(icon(isPlaying ? 'pause' : 'play'), element('span', { text: isPlaying ? 'Pause' : 'Play' }));
  if (!isPlaying) return;
  // Where pictures take long, frames are left out: each that is shown is sharp.
  let due = performance.now() + 1000 / kFramesPerSecond;
  const tick = async (now) => {
    if (!state.isPlaying) return;
    if (now >= due && !(view && (view.isDue || view.isDrawing))) {
      let next = state.at;
      for (; due <= now && next < last; due += 1000 / kFramesPerSecond) next = nextFrame(next, 1);
      await go(next);
      if (state.at === last) return setPlaying(false);
    }
    requestAnimationFrame(tick);
  };
  requestAnimationFrame(tick);
}

// To a moment. What was marked stays marked only where it was found.
async function go(at, finding = null, spot = null) {
  state.spot = spot;
  state.at = Math.min(Math.max(at, 0), last);
  if (finding !== state.finding) {
    state.finding = finding;
    for (const button of document.querySelectorAll('[data-finding]')) button.setAttribute('aria-pressed', String(Number(button.dataset.finding) === finding && finding !== null));
  }
  await update();
  if (document.documentElement.dataset.ready) remember();
}

// Plots follow a little later while somebody scrubs: a browser draws each of them anew.
let plotted = -Infinity, plotting = null;
function showInPlots() {
  const kEvery = 200, left = plotted + kEvery - performance.now();
  clearTimeout(plotting);
  if (left > 0 && view && view.isQuick) {
    plotting = setTimeout(showInPlots, left);
    return;
  }
  plotted = performance.now();
  for (const one of plots) one.setFrame(frameOf(state.at));
}

// Only what is said otherwise than before is written: where the processor draws, text costs as much as the picture.
function say(where, ...parts) {
  const had = [...where.childNodes];
  parts.forEach((part, k) => {
    if (k >= had.length) where.append(part);
    else if (!part.isEqualNode(had[k])) had[k].replaceWith(part);
  });
  for (const more of had.slice(parts.length)) more.remove();
}

// Particles that are not drawn, by reason.
function notDrawn(about) {
  const { frame, removed } = data.frames;
  const gone = removed.reduce((sum, n, k) => sum + (frame[k] <= about.frame ? n : 0), 0);
  const later = data.foreign && data.command !== 'check_state' ? data.body.particles - about.particles - gone : 0;
  const reasons = [[later, 'not yet there'], [about.noNumber, 'at no number'], [about.nowhere - about.noNumber, 'far away']].filter(([n]) => n > 0);
  return reasons.length ? `not drawn: ${reasons.map(([n, why]) => `${plural(n, 'particle')} ${why}`).join(', ')}` : '';
}

async function update() {
  const ticket = ++shown;
  const moment = data.moments[state.at];
  const found = state.finding === null ? null : data.findings[state.finding];
  range.value = state.at;
  range.setAttribute('aria-valuetext', words(moment));
  const facts = [data.hasPieces && plural(moment.components, 'piece'), hasGroups && plural(moment.clusters, data.foreign ? 'coupling group' : 'cluster'), plural(moment.particles, 'particle')].filter(Boolean);
  if (moment.time !== undefined) facts.unshift(`${figure(moment.time)} s`);
  if (data.foreign && moment.swept.length) facts.push('the blade moves');
  if (moment.removed > 0) facts.push(`${count(moment.removed)} removed in this frame`);
  const abouts = besides ? [moment, data.besideMoments[state.at]] : [moment];
  abouts.forEach((about, k) => {
    const text = notDrawn(about);
    if (text) facts.push(besides ? `${sideNames[k]}: ${text}` : text);
    const side = document.querySelectorAll('.side')[k];
    if (side) side.textContent = text ? `${sideNames[k]}: ${text}` : sideNames[k];
  });
  if (data.blade) facts.push(moment.blade ? 'blade down' : 'blade up');
  const apart = apartInWords(comparison, moment, data.foreign);
  if (apart) facts.push(apart);
  say(status, element('strong', { text: words(moment) }), element('span', { class: 'muted', text: ` · ${facts.join(' · ')}` }));
  // The first failure has a card with its words.
  const failing = data.findings.filter((one) => one !== found && failsIn(one, frameOf(state.at))).map((one) => one.property);
  const also = failing.length ? `${found ? ' Also fails here' : 'Fails here'}: ${[...new Set(failing)].join(', ')}.` : '';
  witness.replaceChildren(...(found ? unbroken(`${found.property} fails here${data.foreign ? '.' : `: ${found.text}`}`) : []), also);
  showInPlots();
  document.documentElement.dataset.moment = state.at;
  if (!view) return;
  view.isAwaited = true;
  const arrays = await Promise.all([moments.get(state.at), ...(besides ? [besides.get(state.at)] : [])]).finally(() => { if (ticket === shown) view.isAwaited = false; });
  if (ticket !== shown) return;  // somebody has gone on meanwhile
  const spot = state.spot === null ? null : { particles: [state.spot], path: [], members: [] };
  const marks = found && marksOf(found);
  const said = view.show(arrays, abouts, { ...look, way: look.way && !found }, marks && hasPlace(marks) ? marks : spot);
  const legends = [element('span', { text: said.words })];
  if (said.blade) legends.push(element('span', { id: 'blade-words', text: ` ${said.blade}` }));
  if (said.scale) {
    const ramp = drawing('svg', { class: 'ramp', viewBox: '0 0 70 10', 'aria-hidden': 'true' }, ...rampStops.map((fill, k) => drawing('rect', { x: 10 * k, y: 0, width: 10.5, height: 10, fill })));
    legends.push(element('span', { text: ` ${said.scale[0]} ` }), ramp, element('span', { text: ` ${said.scale[1]}.` }));
  }
  if (said.keys) legends.push(...said.keys.map(([fill, text]) => element('span', { class: 'keyed' }, drawing('svg', { class: 'swatch', viewBox: '0 0 10 10', 'aria-hidden': 'true' }, drawing('rect', { width: 10, height: 10, fill })), element('span', { text }))));
  if (view.plane.isOn) legends.push(element('span', { id: 'cut-words', text: ` ${view.plane.words()}${data.body.kept < data.body.particles ? ' This page holds some of the particles only, so the face has holes.' : ''}` }));
  if (look.skin && !look.particles && arrays[0].triangles.length === 0) legends.push(element('span', { id: 'no-skin', text: ` ${noSkinInWords(moment)}` }));
  if (found) legends.push(element('span', { class: 'marked-key', text: ` ${markedWords(marks, found.clusters)}` }));
  say(legend, ...legends);
  document.documentElement.dataset.shown = `${state.at}/${state.finding === null ? '' : state.finding}`;
}

// Particles are shown where there is no skin, though somebody has asked for it.
function noSkinInWords(moment) {
  const { frame, triangles } = data.frames;
  const first = frame.find((_, k) => triangles[k] > 0);
  return first !== undefined && (moment.start || moment.frame <= first)
    ? `The skin comes at the end of frame ${first}; until then particles are shown.` : 'This moment has no skin, so particles are shown.';
}

function sayCut() {
  const words = byId('cut-words');
  if (words) words.textContent = ` ${view.plane.words()}`;
}

// The moment after a stage of a frame, or the nearest that this page holds.
function momentOf(frame, stage) {
  let best = 0, apart = Infinity;
  data.moments.forEach((moment, k) => {
    if (moment.start && frame >= 0) return;
    const far = Math.abs(frameOf(k) - frame) * 10 + (moment.stage === stage ? 0 : isEnd(k) ? 1 : 2);
    if (far < apart) [best, apart] = [k, far];
  });
  return best;
}

// The first moment that shows what is looked for: the start of a run of ours has no skin.
function firstSkinned() {
  const { frame, triangles } = data.frames;
  const k = look.skin ? triangles.findIndex((n) => n > 0) : -1;
  return k < 0 ? 0 : momentOf(frame[k], 'skin');
}

// Where a page opens: at the first failure; where all holds, at the last frame that cut.
function openingMoment() {
  if (data.foreign) return data.opens < 0 ? 0 : momentOf(data.opens, 'skin');
  const cuts = data.frames.frame.filter((_, k) => data.frames.removed[k] > 0);
  return cuts.length ? momentOf(cuts[cuts.length - 1], 'skin') : last;
}

// --- Links to a moment and a verdict: #frame=46&stage=split&verdict=split+exactness

// A little later while somebody scrubs: browsers take few addresses at once.
let remembered = null;
function remember() {
  clearTimeout(remembered);
  remembered = setTimeout(writeLink, 400);
}
function writeLink() {
  const moment = data.moments[state.at], finding = state.finding === null ? null : data.findings[state.finding];
  const link = new URLSearchParams({ frame: frameOf(state.at) });
  if (!data.foreign && moment.stage !== 'skin') link.set('stage', moment.stage);
  if (finding) link.set('verdict', finding.property);
  history.replaceState(null, '', `#${link}`);
}

// Whether the address names a place of this page, to which it goes.
async function goToLink() {
  const link = new URLSearchParams(location.hash.slice(1)), property = link.get('verdict'), frame = Number(link.get('frame'));
  openLinked(link);
  if (!link.has('frame') && !property) return false;
  const isIt = (finding) => finding.property === property && (!link.has('frame') || finding.frame === frame) && (!link.has('stage') || finding.stage === link.get('stage'));
  const k = data.findings.findIndex(isIt);
  if (k >= 0) await showFinding(k, false);
  else if (Number.isFinite(frame)) await go(momentOf(frame, link.get('stage') || 'skin'));
  return true;
}

async function jump(frame, stage) {
  setPlaying(false);
  await go(momentOf(frame, stage));
  byId('view').scrollIntoView({ block: 'nearest' });
}

// Where the two runs are apart, with the particle that is farthest.
async function showApart(frame, stage) {
  setPlaying(false);
  const at = frame < 0 ? 0 : momentOf(frame, stage);
  const { apart } = data.moments[at];
  if (view) {
    look.colouring = colours.apart;
    byId('colour').value = 'apart';
  }
  await go(at, null, apart && apart.place >= 0 && apart.max !== 0 ? apart.place : null);
  if (view) view.flyToMarks();
  byId('view').scrollIntoView({ block: 'nearest' });
}

// At the top of a page that opens stands what is to be read first.
async function showFinding(k, scrolls = true) {
  setPlaying(false);
  const { marks, property } = data.findings[k];
  const colour = kOfCoupling.includes(property) ? 'cluster' : null;
  if (view && colours[colour]) {
    look.colouring = colours[colour];
    byId('colour').value = colour;
  }
  await go(Math.max(marks.moment, 0), k);
  if (view && !view.flyToMarks() && data.foreign) view.orbit.goHome();
  if (scrolls) byId('view').scrollIntoView({ block: 'nearest' });
}

// --- Put together

function findings() {
  const section = byId('findings');
  const failing = data.findings.filter((one) => !one.expected);
  byId('findings-title').textContent = failing.length ? 'What fails' : isPreview ? 'Nothing has run' : !data.checked ? 'Nothing was judged' : data.holds ? 'Nothing fails' : 'It does not hold';
  if (!data.checked) section.append(element('p', { text: isPreview ? 'This page shows what the scene says. This command runs it and judges what happens:' : 'This page shows what happened. Whether it is right, this command judges:' }));
  if (data.checked && data.holds && !failing.length) {
    const near = data.rows.filter((row) => row.judged > 0 && row.ofBound !== null && !row.asksWider).sort((a, b) => b.ofBound - a.ofBound)[0];
    section.append(element('p', { text: `All that was judged holds${data.findings.length ? ', but for what the scene expects to fail' : ''}.${near ? ` The nearest to its bound is ${near.property}${data.foreign ? '' : ` after ${near.stage}`}, at ${figure(near.ofBound)} of the bound, in frame ${near.frame}.` : ''}` }));
  }
  const apart = comparison && comparisonCard(comparison, data.foreign, showApart);
  // Of two runs, where they part comes first; of a kick, what others feel.
  section.append(...(data.foreign && !comparison?.shown ? [...cards(data, showFinding), apart] : [apart, ...cards(data, showFinding)]).filter(Boolean));
  if (data.findingsLeftOut > 0) section.append(element('p', { class: 'muted', text: `${plural(data.findingsLeftOut, 'later failure')} of the same properties are counted in the table, and not shown.` }));
  section.append(element('h3', { text: data.checked ? 'See it again' : 'Judge it' }), command(data.again));
  const notes = [...data.notReached.map((text) => `Not reached: ${text}`), ...data.notes];
  if (notes.length) section.append(element('h3', { text: 'Good to know' }), element('ul', { class: 'notes' }, ...notes.map((text) => element('li', {}, ...unbroken(text)))));
}

function about() {
  const section = byId('about');
  const say = (text) => section.append(element('p', { text }));
  say(`Positions on this page are rounded to steps of 16 bits, and so off by at most ${figure(data.loss)} h (h is the spacing of particles). Verdicts were made from the full numbers.`);
  if (data.thinned) say(data.thinned);
  const stages = !hasStages ? '' : ' A frame is step, detect, split, merge, expand and skin; a stage that had nothing to do is left out.';
  say(`Frames count from 0.${stages} This page holds ${plural(data.moments.length, 'moment')}. It needs no network. Keys in the 3D view: arrows turn, with Shift they shift; + and − zoom, 0 shows the whole body; space plays, comma and full stop go a ${hasStages ? 'stage' : 'frame'} back and on; C cuts the body open, [ and ] move the cut and Alt with arrows turns it, as dragging with Alt and with Alt and Shift does.`);
  if (!comparison && hasStages) say('A distance to the reference is shown where one was asked for: cutproof run --against reference --report, or cutproof report with a second recording.');
}

async function main() {
  header();
  findings();
  if (hasStages) byId('verdicts-title').textContent = 'Every property after each stage';
  if (data.rows.length) byId('verdicts').append(table(data, jump)); else byId('verdicts').remove();
  plots = isPreview ? [] : plotsOf(data, (frame) => jump(frame, 'skin'));
  if (plots.length) byId('plots').append(element('div', { class: 'grid' }, ...plots.map((one) => one.card))); else byId('plots').remove();
  about();

  const place = element('div', { class: 'canvas' }, canvas);
  const section = byId('view');
  section.append(place);
  if (last < 0) return place.replaceChildren(element('p', { class: 'card', text: 'This recording holds no moment to show.' }));
  const found = contextOf(canvas);
  if (found) {
    view = new View(canvas, found, data);
    if (besides) place.append(element('p', { class: 'side' }), element('p', { class: 'side other' }));
  } else {
    place.replaceChildren(element('p', { class: 'nothing', id: 'no-webgl', text: 'This browser shows no 3D view (WebGL is not there). Everything else on this page works.' }));
  }
  if (view) {
    const first = await moments.chunk(0);
    edges = first.edges || null;
    view.begin(first.moment(0), edges);
    // What is drawn depends on whether there is a cut; where it lies, the GPU knows.
    view.plane.changed = (isOther) => { view.hurry(); if (isOther) update(); else { view.draw(); sayCut(); } };
    section.append(controls(), status, witness, lookControls(data.frames.triangles.some((triangles) => triangles > 0)), legend);
  } else {
    section.append(controls(), status, witness);
  }
  const keys = { ' ': () => setPlaying(!state.isPlaying), ',': () => go(state.at - 1), '.': () => go(state.at + 1) };
  canvas.addEventListener('keydown', (event) => {
    if (view && view.plane.key(event)) return event.preventDefault();
    if (!keys[event.key]) return;
    event.preventDefault();
    keys[event.key]();
  });
  addEventListener('hashchange', goToLink);
  if (!await goToLink()) {
    if (data.findings.length && !data.findings[0].expected) await showFinding(0, false);
    else await go(openingMoment());
  }
  document.documentElement.dataset.ready = 'true';
}

if (data.sheets) showDocuments(data);
else main();
