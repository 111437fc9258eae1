// Points and joined lines over two axes, and stacked bars by name; each point says its configuration where it is hovered
// over or focused, and every plot has a table that says the same.
import { byNumber } from './documents_table.js';
import { drawing, element, figure } from './dom.js';
import { ticks, widthFor } from './plots.js';

const kWidth = widthFor(560), kHeight = 300, kLeft = 66, kRight = 16, kTop = 14, kBottom = 44;
const right = kWidth - kRight, bottom = kHeight - kBottom;
const kLetters = Math.floor(kWidth / 7.2);  // of a bar's name
const kShapes = 6;  // and colours

const isThere = (v) => v !== null && typeof v === 'number';
const named = (axis) => (axis.unit && axis.unit !== '1' ? `${axis.name} [${axis.unit}]` : axis.name);

// From data to the page, and the marks of the axis.
function scaleOf(values, isLogarithmic, from, to) {
  const known = values.filter((v) => isThere(v) && (!isLogarithmic || v > 0));
  let low = known.reduce((a, b) => Math.min(a, b), Infinity), high = known.reduce((a, b) => Math.max(a, b), -Infinity);
  if (!known.length) [low, high] = isLogarithmic ? [0.1, 1] : [0, 1];
  if (isLogarithmic) {
    // A little room, then whole decades if there are several.
    [low, high] = [Math.log10(low), Math.log10(high)];
    const room = Math.max(0.06 * (high - low), 0.04);
    [low, high] = [low - room, high + room];
    const at = (v) => from + ((Math.log10(v) - low) / (high - low)) * (to - from);
    const marks = [];
    const decades = Math.floor(high) - Math.ceil(low);
    const every = Math.max(1, Math.ceil(decades / 6));
    for (let k = Math.ceil(low); k <= high; k += every) marks.push(10 ** k);
    if (marks.length < 3) {
      marks.length = 0;
      const nice = decades >= 0 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9];
      for (let k = Math.floor(low); k <= high; ++k) for (const times of nice) if (Math.log10(times * 10 ** k) >= low && Math.log10(times * 10 ** k) <= high) marks.push(times * 10 ** k);
    }
    if (marks.length < 2) for (const k of [low + 0.1 * (high - low), high - 0.1 * (high - low)]) marks.push(Number((10 ** k).toPrecision(3)));
    return { at, marks: marks.sort((a, b) => a - b), shown: (v) => isThere(v) && v > 0 };
  }
  low = Math.min(low, 0);
  high = high > low ? low + (high - low) * 1.06 : low + 1;
  return { at: (v) => from + ((v - low) / (high - low)) * (to - from), marks: ticks(low, high, 5), shown: isThere };
}

function axes(svg, x, y, xScale, yScale) {
  for (const v of yScale.marks) {
    svg.append(drawing('line', { class: 'rule', x1: kLeft, x2: right, y1: yScale.at(v), y2: yScale.at(v) }),
      drawing('text', { class: 'tick', x: kLeft - 6, y: yScale.at(v) + 4, 'text-anchor': 'end', text: figure(v) }));
  }
  let last = -Infinity;
  for (const v of xScale ? xScale.marks : []) {
    svg.append(drawing('line', { class: 'rule', x1: xScale.at(v), x2: xScale.at(v), y1: kTop, y2: bottom }));
    if (xScale.at(v) - last < 44) continue;  // words need room
    last = xScale.at(v);
    svg.append(drawing('text', { class: 'tick', x: last, y: bottom + 16, 'text-anchor': 'middle', text: figure(v) }));
  }
  svg.append(drawing('text', { class: 'axis', x: (kLeft + right) / 2, y: kHeight - 8, 'text-anchor': 'middle', text: x }),
    drawing('text', { class: 'axis', x: 12, y: (kTop + bottom) / 2, 'text-anchor': 'middle', transform: `rotate(-90 12 ${(kTop + bottom) / 2})`, text: y }));
}

// A shape for each curve, so that nobody needs to tell colours apart.
function shape(which, x, y) {
  const r = 4.6;
  const path = [
    `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0z`,
    `M${x - r} ${y - r}h${2 * r}v${2 * r}h${-2 * r}z`,
    `M${x} ${y - r - 1}L${x + r + 1} ${y + r}H${x - r - 1}z`,
    `M${x} ${y - r - 1.5}L${x + r + 1.5} ${y}L${x} ${y + r + 1.5}L${x - r - 1.5} ${y}z`,
    `M${x} ${y + r + 1}L${x + r + 1} ${y - r}H${x - r - 1}z`,
    `M${x - 2} ${y - r - 1}h4v${r - 1}h${r - 1}v4h${1 - r}v${r - 1}h-4v${1 - r}h${1 - r}v-4h${r - 1}z`][which % kShapes];
  return drawing('path', { d: path });
}

function table(columns, rows, leftOut) {
  const details = element('details', { class: 'figures' }, element('summary', { text: 'The same as a table' }));
  details.addEventListener('toggle', () => {
    if (!details.open || details.querySelector('table')) return;
    details.append(element('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'The same as a table' }, element('table', {},
      element('thead', {}, element('tr', {}, ...columns.map((text, k) => element('th', { scope: 'col', class: byNumber(k > 0 && k >= columns.length - 2), text })))),
      element('tbody', {}, ...rows.map((cells) => element('tr', {}, ...cells.map((text, k) => element(k === 0 ? 'th' : 'td', { scope: k === 0 ? 'row' : null, class: byNumber(k > 0 && k >= cells.length - 2), text }))))))));
    if (leftOut) details.append(element('p', { class: 'muted', text: leftOut }));
  });
  return details;
}

const cell = (v) => (isThere(v) ? figure(v) : typeof v === 'string' ? v : '–');

export function chart(given) {
  const all = given.curves.flatMap((curve) => curve.dots);
  // What is not drawn stretches no axis.
  const drawn = all.filter((dot) => [[dot[0], given.x], [dot[1], given.y]].every(([v, axis]) => isThere(v) && (!axis.logarithmic || v > 0)));
  const xScale = scaleOf(drawn.map((dot) => dot[0]), given.x.logarithmic, kLeft, right);
  const yScale = scaleOf(drawn.map((dot) => dot[1]), given.y.logarithmic, bottom, kTop);
  const readout = element('p', { class: 'readout', role: 'status', text: 'Point at a dot, or go to the plot with Tab and from dot to dot with the arrow keys: here stands which configuration it is.' });
  const svg = drawing('svg', { viewBox: `0 0 ${kWidth} ${kHeight}`, role: 'group', 'aria-label': `${given.title}. ${given.words}` });
  axes(svg, named(given.x), named(given.y), xScale, yScale);
  const dots = [];
  const isShown = (dot) => xScale.shown(dot[0]) && yScale.shown(dot[1]);
  let which = 0;
  const entries = [];
  const groups = [[], []];  // lines below dots
  for (const curve of given.curves) {
    const isLevel = curve.look === 'level' || curve.look === 'front';
    if (!curve.dots.some(isShown)) continue;  // in the table alone
    const kind = isLevel ? null : which++;
    if (curve.look !== 'dots') {
      let path = '', isDown = false;
      for (const dot of curve.dots) {
        if (isShown(dot)) path += `${isDown ? 'L' : 'M'}${xScale.at(dot[0]).toFixed(1)} ${yScale.at(dot[1]).toFixed(1)}`;
        isDown = isShown(dot);
      }
      groups[0].push(drawing('path', { class: isLevel ? curve.look : `line joined line-${kind % kShapes}`, d: path }, drawing('title', { text: curve.name })));
    }
    entries.push(element('li', {}, isLevel ? element('span', { class: `key ${curve.look}-key`, 'aria-hidden': 'true' }) : drawing('svg', { class: `sample fill-${kind % kShapes}`, viewBox: '-8 -8 16 16', 'aria-hidden': 'true' }, shape(kind + Math.floor(kind / kShapes), 0, 0)), element('span', { text: curve.name })));
    if (isLevel) continue;
    for (const dot of curve.dots) {
      if (!isShown(dot)) continue;
      const words = `${dot[2]}${dot[2].includes(curve.name) ? '' : ` (${curve.name})`}: ${given.x.name} ${figure(dot[0])}${given.x.unit ? ` ${given.x.unit}` : ''}, ${given.y.name} ${figure(dot[1])}${given.y.unit && given.y.unit !== '1' ? ` ${given.y.unit}` : ''}`;
      const node = drawing('g', { class: `dot fill-${kind % kShapes}`, role: 'img', tabindex: -1, 'aria-label': words }, shape(kind + Math.floor(kind / kShapes), xScale.at(dot[0]), yScale.at(dot[1])));
      const say = () => { readout.textContent = words; };
      node.addEventListener('pointerenter', say);
      node.addEventListener('focus', say);
      node.addEventListener('click', () => node.focus());
      dots.push({ node, x: dot[0], y: dot[1] });
      groups[1].push(node);
    }
  }
  svg.append(...groups[0], ...groups[1]);
  // One stop of Tab for the plot; arrows go from dot to dot, by x.
  dots.sort((a, b) => a.x - b.x || a.y - b.y);
  if (dots.length) dots[0].node.setAttribute('tabindex', 0);
  svg.addEventListener('keydown', (event) => {
    const at = dots.findIndex((dot) => dot.node === document.activeElement);
    const to = { ArrowRight: at + 1, ArrowDown: at + 1, ArrowLeft: at - 1, ArrowUp: at - 1, Home: 0, End: dots.length - 1 }[event.key];
    if (at < 0 || to === undefined || event.ctrlKey || event.altKey || event.metaKey) return;
    event.preventDefault();
    const next = dots[Math.min(Math.max(to, 0), dots.length - 1)].node;
    for (const dot of dots) dot.node.setAttribute('tabindex', -1);
    next.setAttribute('tabindex', 0);
    next.focus();
  });
  const hidden = all.filter((dot) => !isShown(dot)).length;
  const rows = given.curves.filter((curve) => (curve.look !== 'level' && curve.look !== 'front') || curve.name.startsWith('limit')).flatMap((curve) => curve.dots.map((dot) => [dot[2], curve.name, cell(dot[0]), cell(dot[1])]));
  return element('figure', { class: 'card plot chart' },
    element('figcaption', {}, element('h3', { text: given.title }), element('p', { class: 'muted', text: given.words })),
    svg, element('ul', { class: 'legend' }, ...entries), dots.length > 0 && readout,
    hidden > 0 && element('p', { class: 'muted small', text: `${hidden} of ${all.length} ${all.length === 1 ? 'point lacks' : 'points lack'} a figure on one axis${given.x.logarithmic || given.y.logarithmic ? ', or have 0, which a logarithmic axis cannot show' : ''}: they are in the table below.` }),
    table(['configuration', 'curve', named(given.x), named(given.y)], rows, given.leftOut));
}

// Bars that lie, so that their names have room.
export function stack(given) {
  const sums = given.labels.map((_, k) => given.parts.reduce((sum, part) => sum + (part.values[k] || 0), 0));
  const most = sums.reduce((a, b) => Math.max(a, b), 0) || 1;
  const row = 46, height = kTop + row * given.labels.length + kBottom;
  const at = (v) => 12 + (v / (most * 1.1)) * (right - 12);
  const svg = drawing('svg', { viewBox: `0 0 ${kWidth} ${height}`, role: 'img', 'aria-label': `${given.title}. ${given.words}` });
  for (const v of ticks(0, most * 1.08, 5)) {
    svg.append(drawing('line', { class: 'rule', x1: at(v), x2: at(v), y1: kTop, y2: height - kBottom }),
      drawing('text', { class: 'tick', x: at(v), y: height - kBottom + 16, 'text-anchor': 'middle', text: figure(v) }));
  }
  svg.append(drawing('text', { class: 'axis', x: (12 + right) / 2, y: height - 8, 'text-anchor': 'middle', text: `time [${given.unit}]` }));
  given.labels.forEach((label, k) => {
    const y = kTop + row * k;
    svg.append(drawing('text', { class: 'bar-name', x: 12, y: y + 14, text: label.length > kLetters ? `${label.slice(0, kLetters - 1)}…` : label }));
    let before = 0;
    given.parts.forEach((part, s) => {
      const value = part.values[k] || 0;
      if (value > 0) svg.append(drawing('rect', { class: `fill-${s % kShapes}`, x: at(before), width: Math.max(at(before + value) - at(before) - 0.6, 0.4), y: y + 20, height: 18 }, drawing('title', { text: `${part.name} of ${label}: ${figure(value)} ${given.unit}` })));
      before += value;
    });
  });
  return element('figure', { class: 'card plot chart' },
    element('figcaption', {}, element('h3', { text: given.title }), element('p', { class: 'muted', text: given.words })), svg,
    element('ul', { class: 'legend' }, ...given.parts.map((part, s) => element('li', {}, element('span', { class: `key key-${s % kShapes}`, 'aria-hidden': 'true' }), element('span', { text: part.name })))),
    table(['configuration', 'stage', `time [${given.unit}]`], given.labels.flatMap((label, k) => given.parts.map((part) => [label, part.name, cell(part.values[k])])), ''));
}
