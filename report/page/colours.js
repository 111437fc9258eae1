// What particles are coloured by. Colours of Okabe and Ito, and a ramp from blue to yellow, which people of all kinds of
// colour vision tell apart, on light and on dark (tests/report/colours_test.py). A colour is a number as the GPU takes it: red in its lowest byte.
import { coloursOfClusters } from './cluster_colours.js';
import { figure, plural } from './dom.js';

const kOkabeIto = ['#56B4E9', '#E69F00', '#009E73', '#F0E442', '#CC79A7', '#0072B2', '#D55E00'];
const kRamp = ['#2a63c4', '#5f79bd', '#8a8aa8', '#ac9a90', '#cbab74', '#e6c052', '#f8da2e'];
// Clusters, without the colour of what a verdict names; those behind them where a cluster touches so many others.
const kClusters = ['#56B4E9', '#E69F00', '#009E73', '#F0E442', '#CC79A7', '#0072B2'];
const kMoreClusters = ['#2a5a75', '#7d5600', '#005a41', '#857e1e', '#6b3a55', '#063a58', '#b9dff6', '#f5d58f', '#8fd3bf', '#f8f3b0', '#e8c3d6', '#8cbfdf'];
// What a stage changed, in the order of report/changes.h.
const kChanges = ['#bdb6ae', '#56b4e9', '#f0e442', '#e69f00', '#009e73', '#0b3c8c', '#1b1b1b'];
const kChangeWords = ['nothing', 'moved', 'skin made here', 'in a cluster that lost members, or is new', 'a cluster grew over it', 'in a cluster that was merged', 'removed'];

const channels = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16));
const hexOf = (colour) => `#${[0, 8, 16].map((shift) => ((colour >> shift) & 255).toString(16).padStart(2, '0')).join('')}`;
const packed = ([r, g, b]) => ((r & 255) | ((g & 255) << 8) | ((b & 255) << 16)) >>> 0;
export const kTissue = packed([209, 158, 140]);
export const kGrey = packed([128, 128, 128]);
export const kDead = packed([115, 115, 115]);
const palette = kOkabeIto.map((hex) => packed(channels(hex)));
const changeColours = kChanges.map((hex) => packed(channels(hex)));
export const rampStops = kRamp;
export const kIncomparable = 255;
const kRemoved = 6;

const ramp = new Uint32Array(256);
for (let k = 0; k < 256; ++k) {
  const at = (k / 255) * (kRamp.length - 1), low = Math.min(Math.floor(at), kRamp.length - 2);
  const a = channels(kRamp[low]), b = channels(kRamp[low + 1]);
  ramp[k] = packed(a.map((x, c) => Math.round(x + (at - low) * (b[c] - x))));
}
const onRamp = (share) => ramp[Math.round(255 * Math.min(Math.max(share, 0), 1))];

// The colours of a moment's clusters, found once: moments that have the same clusters share their arrays.
const clusterColours = [...kClusters, ...kMoreClusters].map((hex) => packed(channels(hex)));
const kTiers = [kClusters.length, kMoreClusters.length];
const known = new WeakMap();
function choices(moment, edges, before) {
  const had = known.get(moment.cluster);
  if (had && had.alive === moment.alive && had.edges === edges) return had.found;
  const found = coloursOfClusters(moment.cluster, moment.alive, edges, kTiers, before);
  known.set(moment.cluster, { alive: moment.alive, edges, found });
  return found;
}

// A nice number, not below x: 1, 2 or 5 times a power of ten.
function roundUp(x) {
  const power = 10 ** Math.floor(Math.log10(x));
  for (const times of [1, 2, 5, 10]) if (times * power >= x * 0.999) return times * power;
  return x;
}

function stretches(xyz, alive, edges) {
  const found = new Float32Array(alive.length).fill(1);
  for (let e = 0; e < edges.a.length; ++e) {
    const a = edges.a[e], b = edges.b[e];
    if (!alive[a] || !alive[b]) continue;
    const length = Math.hypot(xyz[3 * a] - xyz[3 * b], xyz[3 * a + 1] - xyz[3 * b + 1], xyz[3 * a + 2] - xyz[3 * b + 2]);
    if (length > found[a]) found[a] = length;
    if (length > found[b]) found[b] = length;
  }
  return found;
}

const pieceColour = (piece) => (piece < 0 ? kGrey : piece === 0 ? kTissue : palette[(piece - 1) % palette.length]);

// Of each piece its size, and its first particle, which tells it from others.
function pieceKeys(of, pieces) {
  const first = new Array(pieces).fill(-1), sizes = new Array(pieces).fill(0);
  of.forEach((piece, i) => { if (piece >= 0 && ++sizes[piece] === 1) first[piece] = i; });
  return sizes.map((n, piece) => [hexOf(pieceColour(piece)), `the piece of particle ${first[piece]} (${plural(n, 'particle')})`]);
}

// So many numbers have a key each; of more there is a scale.
const kMostKeys = 9;

// A distance of its byte (report/beside.h): four to a decade from 1e-18 h on.
const decade = (code) => code / 4 - 18;

// Each: what it is called, and of a picture the colour of each particle and a legend: words, a scale or keys.
// `comparison`: with another run, or null. foreign: of somebody else's run, whose clusters are coupling groups.
export function colourings(hasStretch, comparison, { foreign, hasPieces, hasGroups, moments, body } = { hasPieces: true, hasGroups: true, moments: [] }) {
  let farthest = 1e-9;  // so far, so that colours mean the same from frame to frame
  // Of all moments, so that a colour is one distance.
  const ranges = moments.map((moment) => moment.apart && moment.apart.codes).filter(Boolean);
  const most = ranges.reduce((most, [, code]) => Math.max(most, code), 1);
  const low = ranges.reduce((least, [code]) => Math.min(least, code), Math.max(most - 4, 0));
  const all = {
    piece: {
      name: 'piece of tissue',
      mayBeCovered: true,  // by what is marked
      of({ moment }) {
        let pieces = 0;
        for (const piece of moment.piece) if (piece >= pieces) pieces = piece + 1;
        return {
          colour: (i) => pieceColour(moment.piece[i]),
          words: pieces <= 1 ? 'One piece of tissue.' : `${pieces} pieces of tissue, each in a colour of its own${pieces > kMostKeys ? '; the largest is pink' : ''}.`,
          // A page that holds some particles only has other numbers of them.
          keys: pieces > 1 && pieces <= kMostKeys && body && body.kept === body.particles ? pieceKeys(moment.piece, pieces) : undefined,
        };
      },
    },
    cluster: {
      name: foreign ? 'what is coupled' : 'cluster',
      of({ moment, edges, first }) {
        const chosen = choices(moment, edges, first && first !== moment ? choices(first, edges, null) : null);
        return {
          colour: (i) => (moment.cluster[i] < 0 ? kGrey : clusterColours[chosen[moment.cluster[i]]]),
          words: foreign ? 'Particles of one colour are coupled with each other, by one coupling group or a chain of them; grey: in none.' : `Each particle has the colour of the first cluster that holds it${edges ? '; where two such meet, or no more than two layers of removed particles lie between them, their colours differ' : ''}.`,
        };
      },
    },
    change: {
      name: 'what the last stage changed',
      of({ moment, stage, isStart }) {
        const counts = new Array(kChanges.length).fill(0);
        const change = moment.change;
        if (change) for (const code of change) if (code < counts.length) ++counts[code];
        const keys = counts.map((n, code) => [kChanges[code], `${kChangeWords[code]} (${plural(n, 'particle')})`, n]).filter(([, , n], code) => code > 0 && n > 0);
        return {
          colour: (i) => changeColours[change ? change[i] : 0] || kGrey,
          shows: (i) => (change && change[i] === kRemoved ? 2 : 0),
          words: isStart ? 'Nothing has run yet.' : keys.length ? `Since the snapshot before, ${stage} has changed:` : `Since the snapshot before, ${stage} has changed no particle.`,
          keys,
        };
      },
    },
    displacement: {
      name: 'displacement',
      of({ places, start }) {
        const xyz = places();
        const far = new Float32Array(xyz.length / 3);
        for (let i = 0; i < far.length; ++i) {
          far[i] = Math.hypot(xyz[3 * i] - start[3 * i], xyz[3 * i + 1] - start[3 * i + 1], xyz[3 * i + 2] - start[3 * i + 2]);
          if (far[i] > farthest) farthest = far[i];
        }
        const end = roundUp(farthest);
        return { colour: (i) => onRamp(far[i] / end), words: 'How far each particle is from where it began.', scale: ['0 h', `${figure(end)} h`] };
      },
    },
    apart: {
      name: comparison && comparison.shown ? 'distance between the two' : comparison && `distance to ${comparison.name}`,
      of({ moment, apart }) {
        const codes = moment.apart;
        if (!apart) return { colour: () => kGrey, words: 'This moment has no counterpart, so there is no distance.' };
        return {
          colour: (i) => { const code = codes ? codes[i] : 0; return code === kIncomparable ? changeColours[3] : code === 0 ? ramp[0] : onRamp((code - low) / (most - low)); },
          words: `Distance to ${comparison.obtained}; on a logarithmic scale. Orange: there in one of the two only.`,
          scale: ranges.length ? [`${figure(10 ** decade(low))} h or less`, `${figure(10 ** decade(most))} h`] : ['0 h', 'nowhere more'],
        };
      },
    },
    stretch: {
      name: 'stretch',
      of({ places, moment, edges }) {
        const found = stretches(places(), moment.alive, edges);
        return { colour: (i) => onRamp((found[i] - 1) / 0.5), words: 'Length of each particle’s longest edge.', scale: ['1 h: at rest', '1.5 h and more'] };
      },
    },
    holders: {
      name: foreign ? 'number of coupling groups' : 'number of clusters',
      of({ moment }) {
        const counts = [];
        moment.holders.forEach((holders, i) => { if (moment.alive[i]) counts[holders] = (counts[holders] || 0) + 1; });
        const greatest = Math.max(counts.length - 1, 1), words = `How many ${foreign ? 'coupling groups' : 'clusters'} hold each particle.`;
        const colour = (i) => onRamp(moment.holders[i] / greatest);
        if (counts.length > kMostKeys) return { colour, words, scale: ['0', String(greatest)] };
        return { colour, words, keys: counts.map((n, holders) => [hexOf(onRamp(holders / greatest)), `${holders} (${plural(n, 'particle')})`]).filter(Boolean) };
      },
    },
  };
  if (!hasStretch) delete all.stretch;
  if (!hasPieces) delete all.piece;
  if (foreign) delete all.change;
  if (!hasGroups) { delete all.cluster; delete all.holders; }
  if (!comparison) delete all.apart;
  return all;
}
