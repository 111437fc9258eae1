// Which of a few colours each cluster gets, so that clusters that touch differ. It needs nothing but its arguments: the
// tests run it alone (tests/report/scenes_test.py).

// Clusters touch where an edge joins them, or where an edge did before particles went: so the two sides of a cut of up
// to two layers differ as well. Returns for each cluster those that touch it, as one list from `first[k]` to
// `first[k + 1]`. `of`: place of each particle's cluster, or -1.
function touching(count, of, alive, a, b) {
  const found = new Set();
  const touch = (s, t) => { if (s !== t && s >= 0 && t >= 0) found.add(s < t ? s * count + t : t * count + s); };
  const beside = new Map();  // of a dead particle the clusters beside it
  let last = -1, lastOther = -1;
  for (let e = 0; e < a.length; ++e) {
    const i = a[e], j = b[e], s = of[i], t = of[j];
    if (alive[i] && alive[j]) {
      if (s === last && t === lastOther) continue;  // as its neighbour in the list, mostly
      [last, lastOther] = [s, t];
      touch(s, t);
    } else if (alive[i] || alive[j]) {
      const [dead, cluster] = alive[i] ? [j, s] : [i, t];
      const list = beside.get(dead);
      if (!list) beside.set(dead, [cluster]);
      else if (!list.includes(cluster)) list.push(cluster);
    }
  }
  for (const list of beside.values()) for (const s of list) for (const t of list) touch(s, t);
  for (let e = 0; e < a.length; ++e) {
    if (alive[a[e]] || alive[b[e]]) continue;
    const here = beside.get(a[e]), there = beside.get(b[e]);
    if (here && there) for (const s of here) for (const t of there) touch(s, t);
  }
  const first = new Int32Array(count + 1);
  for (const key of found) { ++first[Math.floor(key / count) + 1]; ++first[(key % count) + 1]; }
  for (let k = 0; k < count; ++k) first[k + 1] += first[k];
  const at = first.slice(), others = new Int32Array(first[count]);
  for (const key of found) {
    const s = Math.floor(key / count), t = key % count;
    others[at[s]++] = t;
    others[at[t]++] = s;
  }
  return { first, others };
}

// cluster: of each particle, a number that its cluster has for itself, or -1; edges: {a, b}, or null where they are not
// known; tiers: how many colours there are, those first that are told apart best; before: what this returned for
// another moment, of which clusters keep their colours where they may, or null. Returns the colours by number.
export function coloursOfClusters(cluster, alive, edges, tiers, before) {
  let most = -1;
  for (const number of cluster) if (number > most) most = number;
  const place = new Int32Array(most + 1).fill(-1);
  for (const number of cluster) if (number >= 0) place[number] = 0;
  const numbers = [];
  for (let number = 0; number <= most; ++number) {
    if (place[number] === 0) { place[number] = numbers.length; numbers.push(number); }
  }
  const of = new Int32Array(cluster.length).fill(-1);
  for (let i = 0; i < cluster.length; ++i) if (cluster[i] >= 0 && alive[i]) of[i] = place[cluster[i]];
  const { first, others } = edges ? touching(numbers.length, of, alive, edges.a, edges.b)
    : { first: new Int32Array(numbers.length + 1), others: [] };
  const colour = new Int16Array(numbers.length).fill(-1);
  const total = tiers.reduce((sum, n) => sum + n, 0);
  const taken = new Int32Array(total).fill(-1);  // by whom it was found to be taken
  const choose = (k) => {
    const number = numbers[k];
    for (let n = first[k]; n < first[k + 1]; ++n) if (colour[others[n]] >= 0) taken[colour[others[n]]] = k;
    const mixed = Math.imul(number + 1, 0x9e3779b1) >>> 0;
    let from = 0;
    for (const size of tiers) {
      for (let c = 0; c < size; ++c) {
        const one = from + ((mixed + c) % size);
        if (taken[one] !== k) return one;
      }
      from += size;
    }
    return mixed % total;  // it touches so many that one of them has the same
  };
  const had = (k) => (before && numbers[k] < before.length ? before[numbers[k]] : -1);
  for (let k = 0; k < numbers.length; ++k) {
    if (had(k) < 0) continue;
    let isFree = true;
    for (let n = first[k]; n < first[k + 1]; ++n) if (colour[others[n]] === had(k)) isFree = false;
    colour[k] = isFree ? had(k) : choose(k);
  }
  // Those that touch most choose first.
  const touches = (k) => first[k + 1] - first[k];
  const open = numbers.map((_, k) => k).filter((k) => colour[k] < 0).sort((s, t) => touches(t) - touches(s) || s - t);
  for (const k of open) colour[k] = choose(k);
  const found = new Int16Array(most + 1).fill(-1);
  numbers.forEach((number, k) => { found[number] = colour[k]; });
  return found;
}
