// What particles are coloured by. Colours of Okabe and Ito and of cividis, which people of all kinds of colour vision
// tell apart.
import { figure } from './dom.js';

const kOkabeIto = ['#56B4E9', '#E69F00', '#009E73', '#F0E442', '#CC79A7', '#0072B2', '#D55E00'];
const kCividis = ['#00224e', '#2a3f6d', '#575d6d', '#7d7c78', '#a59c74', '#d2c060', '#fee838'];
export const kTissue = [0.82, 0.62, 0.55];

const rgb = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
const palette = kOkabeIto.map(rgb);
const ramp = kCividis.map(rgb);
export const rampStops = kCividis;

function onRamp(share) {
  const at = Math.min(Math.max(share, 0), 1) * (ramp.length - 1);
  const k = Math.min(Math.floor(at), ramp.length - 2);
  return ramp[k].map((low, c) => low + (at - k) * (ramp[k + 1][c] - low));
}

// A number's own colour: the same in every frame.
function coloured(key) {
  if (key < 0) return [0.5, 0.5, 0.5];
  const mixed = Math.imul(key + 1, 0x9e3779b1) >>> 0;
  const hue = palette[mixed % palette.length];
  const light = 0.72 + 0.14 * ((mixed >>> 8) % 3);
  return hue.map((c) => c * light);
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

// Each: what it is called, and of a picture the colour of each particle and a legend.
export function colourings(hasStretch) {
  let farthest = 1e-9;  // so far, so that colours mean the same from frame to frame
  const all = {
    piece: {
      name: 'piece of tissue',
      of({ moment }) {
        let pieces = 0;
        for (const piece of moment.piece) if (piece >= pieces) pieces = piece + 1;
        return {
          colour: (i) => (moment.piece[i] < 0 ? [0.5, 0.5, 0.5] : moment.piece[i] === 0 ? kTissue
            : palette[(moment.piece[i] - 1) % palette.length]),
          words: pieces <= 1 ? 'One piece of tissue.' : `${pieces} pieces of tissue, each in a colour of its own; the largest is pink.`,
        };
      },
    },
    cluster: {
      name: 'cluster',
      of: ({ moment }) => ({ colour: (i) => coloured(moment.cluster[i]), words: 'Each particle has the colour of the first cluster that holds it.' }),
    },
    displacement: {
      name: 'displacement',
      of({ xyz, start }) {
        const far = new Float32Array(xyz.length / 3);
        for (let i = 0; i < far.length; ++i) {
          far[i] = Math.hypot(xyz[3 * i] - start[3 * i], xyz[3 * i + 1] - start[3 * i + 1], xyz[3 * i + 2] - start[3 * i + 2]);
          if (far[i] > farthest) farthest = far[i];
        }
        const most = roundUp(farthest);
        return { colour: (i) => onRamp(far[i] / most), words: 'How far each particle is from where it began.', scale: ['0 h', `${figure(most)} h`] };
      },
    },
    stretch: {
      name: 'stretch',
      of({ xyz, moment, edges }) {
        const found = stretches(xyz, moment.alive, edges);
        return { colour: (i) => onRamp((found[i] - 1) / 0.5), words: 'Length of each particle’s longest edge.', scale: ['1 h: at rest', '1.5 h and more'] };
      },
    },
    holders: {
      name: 'number of clusters',
      of({ moment }) {
        let most = 1;
        for (const holders of moment.holders) if (holders > most) most = holders;
        return { colour: (i) => onRamp(moment.holders[i] / most), words: 'How many clusters hold each particle.', scale: ['0', String(most)] };
      },
    },
  };
  if (!hasStretch) delete all.stretch;
  return all;
}
