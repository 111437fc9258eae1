// Takes back what report/coding.cpp has packed.

export async function inflate(base64) {
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const unfolded = (code) => (code >>> 1) ^ -(code & 1);

// Places lie as the GPU takes them: x, y, z and one that is not used, because it wants four bytes' multiples.
export const kStride = 4;

function steps(data, offset, points, before) {
  const n = 3 * points;
  const found = new Uint16Array(kStride * points);
  let last = 0, i = 0;
  for (let axis = 0; axis < 3; ++axis) {
    for (let p = 0, to = axis; p < points; ++p, ++i, to += kStride) {
      last = (last + unfolded(data[offset + i] | (data[offset + n + i] << 8))) & 0xffff;
      found[to] = before ? last + before[to] : last;  // kept modulo 65536 by the array
    }
  }
  return found;
}

function integers(data, offset, n) {
  const found = new Int32Array(n);
  let last = 0;
  for (let i = 0; i < n; ++i) {
    const code = data[offset + i] | (data[offset + n + i] << 8) | (data[offset + 2 * n + i] << 16) |
      (data[offset + 3 * n + i] << 24);
    last = (last + unfolded(code)) | 0;
    found[i] = last;
  }
  return found;
}

function flags(data, offset, n) {
  const found = new Uint8Array(n);
  for (let i = 0; i < n; ++i) found[i] = (data[offset + (i >> 3)] >> (i & 7)) & 1;
  return found;
}

const kNone = { x: new Uint16Array(0), skin: new Uint16Array(0), alive: new Uint8Array(0), piece: new Int32Array(0),
  cluster: new Int32Array(0), holders: new Uint8Array(0), owner: new Int32Array(0), triangles: new Int32Array(0),
  change: null, apart: null };

// A chunk's moments, each with all of its arrays: what one does not have is as it was in the moment before. They are
// taken apart when they are asked for, each after those before it, so that nobody who plays waits for a whole chunk.
class Chunk {
  constructor(bytes) {
    const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
    this.head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
    this.data = bytes.subarray(4 + length);
    this.moments = [];
    this.size = bytes.byteLength;
    const edges = this.head.edges;
    this.edges = edges && { a: integers(this.data, edges[0], edges[1]), b: integers(this.data, edges[0] + 4 * edges[1], edges[1]) };
  }

  moment(k) {
    while (this.moments.length <= k) {
      const given = this.head.moments[this.moments.length], data = this.data;
      const bytes = (one) => data.slice(one[0], one[0] + one[1]);
      const now = { ...(this.moments[this.moments.length - 1] || kNone), low: this.head.low, high: this.head.high };
      for (const name of ['x', 'skin']) {
        if (given[name]) now[name] = steps(data, given[name][0], given[name][1], given[name][2] ? now[name] : null);
      }
      for (const name of ['piece', 'cluster', 'owner', 'triangles']) {
        if (given[name]) now[name] = integers(data, ...given[name]);
      }
      if (given.alive) now.alive = flags(data, ...given.alive);
      if (given.holders) now.holders = bytes(given.holders);
      // What a stage changed and how far it is from another run are of one moment alone; null: nothing, nowhere.
      now.change = given.change ? bytes(given.change) : null;
      now.apart = given.apart ? bytes(given.apart) : null;
      for (const name of Object.keys(given)) this.size += now[name].byteLength;
      this.moments.push(now);
    }
    return this.moments[k];
  }
}

export const kNowhere = 65535;

// How steps become places as the view has them: in h, from `centre`.
export function scaleOf(moment, centre, spacing) {
  return { low: [0, 1, 2].map((axis) => (moment.low[axis] - centre[axis]) / spacing),
    step: [0, 1, 2].map((axis) => (moment.high[axis] - moment.low[axis]) / 65534 / spacing) };
}

// Places of points, three numbers each. What is nowhere is NaN.
export function places(found, moment, centre, spacing) {
  const n = found.length / kStride;
  const xyz = new Float32Array(3 * n);
  const { low, step } = scaleOf(moment, centre, spacing);
  for (let i = 0; i < n; ++i) {
    for (let axis = 0; axis < 3; ++axis) {
      const k = found[kStride * i + axis];
      xyz[3 * i + axis] = k === kNowhere ? NaN : low[axis] + step[axis] * k;
    }
  }
  return xyz;
}

// What is taken apart stays, up to so many bytes; what nobody has looked at for longest goes first.
const kMostBytes = 160 * 2 ** 20;

// All moments of a run, a chunk at a time. `name`: of the elements that hold them, from number `from` on.
export class Moments {
  constructor(firstMoment, name = 'chunk', from = 0) {
    this.firstMoment = firstMoment;
    this.name = name;
    this.from = from;
    this.chunks = new Map();  // in the order in which they were last used
    this.last = 0;
  }

  chunkOf(index) {
    let k = this.firstMoment.length - 1;
    while (k > 0 && this.firstMoment[k] > index) --k;
    return k;
  }

  start(k) {
    let found = this.chunks.get(k);
    if (!found) {
      found = { chunk: null };
      found.promise = (async () => {
        const id = `${this.name}-${this.from + k}`;
        // A large page may still be on its way, and an element is there before all of its text is.
        const isWhole = () => document.readyState !== 'loading' || Boolean((document.getElementById(id) || {}).nextElementSibling);
        while (!isWhole()) await new Promise((resolve) => setTimeout(resolve, 30));
        found.chunk = new Chunk(await inflate(document.getElementById(id).textContent.trim()));
        return found.chunk;
      })();
      // What could not be had, for want of memory perhaps, is tried again when it is asked for again.
      found.promise.catch(() => this.chunks.delete(k));
    }
    this.chunks.delete(k);
    this.chunks.set(k, found);
    return found.promise;
  }

  async chunk(k) {
    return this.start(k);
  }

  async get(index) {
    const k = this.chunkOf(index);
    const chunk = await this.start(k);
    const moment = chunk.moment(index - this.firstMoment[k]);
    // Ahead, the way that somebody goes: inflating is the browser's work, in a thread of its own.
    const ahead = index >= this.last ? k + 1 : k - 1;
    this.last = index;
    if (ahead >= 0 && ahead < this.firstMoment.length && !this.chunks.has(ahead)) this.start(ahead);
    this.forget(k);
    return moment;
  }

  forget(k) {
    let bytes = 0;
    for (const { chunk } of this.chunks.values()) bytes += chunk ? chunk.size : 0;
    for (const [old, { chunk }] of [...this.chunks]) {
      if (bytes <= kMostBytes) break;
      if (old === 0 || Math.abs(old - k) <= 1 || !chunk) continue;
      bytes -= chunk.size;
      this.chunks.delete(old);
    }
  }
}
