// Lines and stacked bars over frames, as SVG, with the same figures as a table below.
import { count, drawing, element, figure } from './dom.js';

// A drawing is as wide as a narrow page has room, so that its letters are as large there.
export const widthFor = (most) => Math.max(Math.min(most, innerWidth - 64), 240);
const kWidth = widthFor(520), kHeight = 220, kLeft = 58, kRight = 14, kTop = 14, kBottom = 40;
const kMostBars = 130;

export function ticks(low, high, most) {
  const raw = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((k) => k * power).find((k) => k >= raw);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; ++k) found.push(k * step || 0);  // no -0
  return found;
}

// options: title, words (what is to be seen, in a sentence), unit, frames (numbers along x), series [{name, values}],
// kind: 'lines' | 'bars'; logarithmic; whole (counts); jump(frame).
export function plot(options) {
  const { frames, series } = options;
  const right = kWidth - kRight, bottom = kHeight - kBottom;
  const known = series.flatMap((one) => one.values).filter((v) => v !== null && (!options.logarithmic || v > 0));
  const isStacked = options.kind === 'bars';
  const sums = isStacked ? frames.map((_, k) => series.reduce((sum, one) => sum + (one.values[k] || 0), 0)) : known;
  let high = sums.reduce((a, b) => Math.max(a, b), 0) || 1;
  let low = options.logarithmic ? known.reduce((a, b) => Math.min(a, b), Infinity) : 0;
  if (options.logarithmic) {
    low = Number.isFinite(low) ? 10 ** Math.floor(Math.log10(low)) : high / 10;
    high = 10 ** Math.ceil(Math.log10(high) + 1e-9);
    if (high / low > 1e12) low = high / 1e12;
  } else {
    high *= 1.06;
  }
  const first = frames[0], last = Math.max(frames[frames.length - 1], first + 1);
  const x = (frame) => kLeft + ((frame - first) / (last - first)) * (right - kLeft);
  const share = (v) => (options.logarithmic ? Math.log(Math.max(v, low) / low) / Math.log(high / low) : v / high);
  const y = (v) => bottom - share(v) * (bottom - kTop);

  const svg = drawing('svg', { viewBox: `0 0 ${kWidth} ${kHeight}`, role: 'img', 'aria-label': `${options.title}. ${options.words}` });
  let marks = options.logarithmic ? [] : ticks(0, high, 4);
  if (options.whole) marks = marks.filter((v) => Number.isInteger(v));
  if (options.logarithmic) {
    const decades = Math.round(Math.log10(high / low));
    for (let k = 0; k <= decades; k += Math.ceil(decades / 5)) marks.push(low * 10 ** k);
  }
  for (const v of marks) {
    svg.append(drawing('line', { class: 'rule', x1: kLeft, x2: right, y1: y(v), y2: y(v) }),
      drawing('text', { class: 'tick', x: kLeft - 6, y: y(v) + 4, 'text-anchor': 'end', text: options.whole ? count(v) : figure(v) }));
  }
  for (const f of ticks(first, last, 6).filter((v) => Number.isInteger(v) && v >= 0)) {
    svg.append(drawing('text', { class: 'tick', x: x(f), y: bottom + 16, 'text-anchor': 'middle', text: String(f) }));
  }
  // Where the state as loaded comes first, it is no frame.
  if (first < 0) svg.append(drawing('text', { class: 'tick', x: x(first), y: bottom + 28, 'text-anchor': 'middle', text: 'as loaded' }), drawing('line', { class: 'rule', x1: x(first), x2: x(first), y1: bottom, y2: bottom + 16 }));
  svg.append(drawing('text', { class: 'axis', x: (kLeft + right) / 2, y: kHeight - 6, 'text-anchor': 'middle', text: 'frame' }),
    drawing('text', { class: 'axis', x: 12, y: (kTop + bottom) / 2, 'text-anchor': 'middle', transform: `rotate(-90 12 ${(kTop + bottom) / 2})`, text: options.unit }));

  if (isStacked) {
    const every = Math.ceil(frames.length / kMostBars);
    const width = Math.max(((right - kLeft) / Math.ceil(frames.length / every)) * 0.86, 1);
    for (let begin = 0; begin < frames.length; begin += every) {
      const end = Math.min(begin + every, frames.length);
      let below = 0;
      series.forEach((one, s) => {
        let mean = 0;
        for (let k = begin; k < end; ++k) mean += (one.values[k] || 0) / (end - begin);
        if (mean > 0) {
          svg.append(drawing('rect', { class: `fill-${s}`, x: kLeft + (begin / frames.length) * (right - kLeft), width, y: y(below + mean), height: Math.max(y(below) - y(below + mean), 0) }));
        }
        below += mean;
      });
    }
  } else {
    series.forEach((one, s) => {
      let path = '', isDown = false;
      one.values.forEach((v, k) => {
        const isThere = v !== null && (!options.logarithmic || v > 0);
        if (isThere) path += `${isDown ? 'L' : 'M'}${x(frames[k]).toFixed(1)} ${y(v).toFixed(1)}`;
        isDown = isThere;
      });
      svg.append(drawing('path', { class: `line line-${s}`, d: path }));
    });
  }
  const cursor = drawing('line', { class: 'cursor', y1: kTop, y2: bottom, x1: 0, x2: 0 });
  // Moved as a layer of its own: a plot that is drawn anew for each moment costs more than the 3D view.
  cursor.style.transform = `translateX(${x(first)}px)`;
  svg.append(cursor);
  svg.addEventListener('click', (event) => {
    const at = ((event.clientX - svg.getBoundingClientRect().left) / svg.clientWidth) * kWidth;
    options.jump(Math.round(first + ((at - kLeft) / (right - kLeft)) * (last - first)));
  });

  const legend = series.length > 1 && element('ul', { class: 'legend' },
    ...series.map((one, s) => element('li', {}, element('span', { class: `key key-${s}`, 'aria-hidden': 'true' }), element('span', { text: one.name }))));
  const table = element('details', { class: 'figures' }, element('summary', { text: 'The same as a table' }));
  // Only where somebody wants it: a long run has many rows.
  table.addEventListener('toggle', () => {
    if (!table.open || table.querySelector('table')) return;
    const cell = (v) => element('td', { text: v === null || v === undefined ? '–' : options.whole ? count(v) : figure(v) });
    table.append(element('div', { class: 'scroll' }, element('table', {},
      element('thead', {}, element('tr', {}, element('th', { scope: 'col', text: 'frame' }),
        ...series.map((one) => element('th', { scope: 'col', text: series.length > 1 ? `${one.name} [${options.unit}]` : options.unit })))),
      element('tbody', {}, ...frames.map((frame, k) => element('tr', {}, element('th', { scope: 'row', text: frame < 0 ? 'as loaded' : String(frame) }), ...series.map((one) => cell(one.values[k]))))))));
  });
  return {
    card: element('figure', { class: 'card plot' }, element('figcaption', {}, element('h3', { text: options.title }), element('p', { class: 'muted', text: options.words })), svg, legend, table),
    setFrame(frame) {
      const at = x(Math.min(Math.max(frame, first), last));
      cursor.style.transform = `translateX(${at}px)`;
    },
  };
}

// All plots that the page's data allow.
export function plotsOf(data, jump) {
  const found = [], { comparison } = data, isBeside = comparison && comparison.shown;
  const ends = data.frames, whose = isBeside ? `${comparison.ownName}: ` : '';
  const first = (column) => ends[column][0], last = (column) => ends[column][ends[column].length - 1];
  const greatest = (column) => ends[column].reduce((a, b) => Math.max(a, b), 0);
  const least = (column) => ends[column].reduce((a, b) => Math.min(a, b), Infinity);
  const changes = (column, what) => (least(column) === greatest(column)
    ? `${whose}${count(first(column))} ${what} throughout.` : `${whose}${count(first(column))} at first, ${count(last(column))} at the end; between ${count(least(column))} and ${count(greatest(column))}.`);
  if (ends.frame.length > 1) {
    const other = new Map(isBeside ? data.moments.map((moment, k) => [moment.start ? -1 : moment.frame, data.besideMoments[k]]) : []);
    const lines = (title, column, unit, words) => {
      const series = [{ name: isBeside ? comparison.ownName : unit, values: ends[column] }];
      if (isBeside && column !== 'removed') series.push({ name: comparison.name, values: ends.frame.map((frame) => (other.has(frame) ? other.get(frame)[column] : null)) });
      found.push(plot({ title, words, unit, frames: ends.frame, series, kind: 'lines', whole: true, jump }));
    };
    if (data.hasPieces) lines('Pieces of tissue', 'components', 'pieces', changes('components', first('components') === 1 ? 'piece' : 'pieces'));
    const groups = data.foreign ? 'coupling groups' : 'clusters';
    if (greatest('clusters') > 0) lines(data.foreign ? 'Coupling groups' : 'Clusters', 'clusters', groups, changes('clusters', groups));
    if (greatest('removed') > 0) {
      const all = ends.removed.reduce((a, b) => a + b, 0);
      lines('Particles removed', 'removed', 'particles', `${count(all)} of ${count(data.body.particles)} in all.`);
    }
  }
  if (data.seconds.length) {
    const values = data.seconds.map((one) => ({ name: one.name, values: one.values.map((v) => (v === null ? null : 1e3 * v)) }));
    const frames = values[0].values.map((_, k) => k);
    const total = values.reduce((sum, one) => sum + one.values.reduce((a, b) => a + (b || 0), 0), 0) / frames.length;
    const merged = frames.length > kMostBars ? ` Each bar is the mean of ${Math.ceil(frames.length / kMostBars)} frames.` : '';
    found.push(plot({ title: 'Time of each stage', words: `${figure(total)} ms a frame on average.${merged}`, unit: 'ms', frames, series: values, kind: 'bars', jump }));
  }
  if (data.errors.length) {
    found.push(plot({ title: 'Error', words: 'Distance from the solution that it was compared with, in particle spacings h.', unit: 'h', frames: data.errors[0].values.map((_, k) => k), series: data.errors, kind: 'lines', logarithmic: true, jump }));
  }
  return found;
}
