// Takes back what report/coding.cpp has packed.

export async function inflate(base64) {
  const text = atob(base64);
  const packed = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) packed[i] = text.charCodeAt(i);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('gzip'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

const unfolded = (code) => (code >>> 1) ^ -(code & 1);

function steps(data, offset, points, before) {
  const n = 3 * points;
  const found = new Uint16Array(n);
  let last = 0;
  for (let i = 0; i < n; ++i) {
    last = (last + unfolded(data[offset + i] | (data[offset + n + i] << 8))) & 0xffff;
    found[i] = before ? last + before[i] : last;  // kept modulo 65536 by the array
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
  cluster: new Int32Array(0), holders: new Uint8Array(0), owner: new Int32Array(0), triangles: new Int32Array(0) };

// A chunk's moments, each with all of its arrays: what one does not have is as it was in the moment before.
export function unpack(bytes) {
  const length = new DataView(bytes.buffer, bytes.byteOffset).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const data = bytes.subarray(4 + length);
  let now = kNone;
  let size = 0;
  const moments = head.moments.map((given) => {
    now = { ...now, low: head.low, high: head.high };
    for (const name of ['x', 'skin']) {
      if (given[name]) now[name] = steps(data, given[name][0], given[name][1], given[name][2] ? now[name] : null);
    }
    for (const name of ['piece', 'cluster', 'owner', 'triangles']) {
      if (given[name]) now[name] = integers(data, ...given[name]);
    }
    if (given.alive) now.alive = flags(data, ...given.alive);
    if (given.holders) now.holders = data.slice(given.holders[0], given.holders[0] + given.holders[1]);
    for (const name of Object.keys(given)) size += now[name].byteLength;
    return now;
  });
  const edges = head.edges && {
    a: integers(data, head.edges[0], head.edges[1]),
    b: integers(data, head.edges[0] + 4 * head.edges[1], head.edges[1]),
  };
  return { moments, edges, size };
}

export const kNowhere = 65535;

// Places as the view has them: in h, from `centre`. What is nowhere is NaN.
export function places(found, moment, centre, spacing) {
  const n = found.length / 3;
  const xyz = new Float32Array(found.length);
  for (let axis = 0; axis < 3; ++axis) {
    const low = (moment.low[axis] - centre[axis]) / spacing;
    const step = (moment.high[axis] - moment.low[axis]) / 65534 / spacing;
    for (let i = 0; i < n; ++i) {
      const k = found[axis * n + i];
      xyz[3 * i + axis] = k === kNowhere ? NaN : low + step * k;
    }
  }
  return xyz;
}

// All moments of the page, a chunk at a time.
export class Moments {
  constructor(firstMoment) {
    this.firstMoment = firstMoment;
    this.chunks = new Map();  // in the order in which they were last used
  }

  chunkOf(index) {
    let k = this.firstMoment.length - 1;
    while (k > 0 && this.firstMoment[k] > index) --k;
    return k;
  }

  async chunk(k) {
    let found = this.chunks.get(k);
    if (!found) {
      // A large page may still be on its way.
      while (!document.getElementById(`chunk-${k}`) && document.readyState === 'loading') {
        await new Promise((resolve) => setTimeout(resolve, 30));
      }
      found = inflate(document.getElementById(`chunk-${k}`).textContent.trim()).then(unpack);
    }
    this.chunks.delete(k);
    this.chunks.set(k, found);
    const done = await found;
    // What is not looked at any more is inflated again when it is.
    const kMost = 6;
    for (const old of this.chunks.keys()) {
      if (this.chunks.size <= kMost) break;
      if (old !== 0) this.chunks.delete(old);
    }
    return done;
  }

  async get(index) {
    const k = this.chunkOf(index);
    return (await this.chunk(k)).moments[index - this.firstMoment[k]];
  }
}
