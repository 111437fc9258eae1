// What is marked of a verdict, and what the colours of the marks mean.
import { plural } from './dom.js';

// A detection that names two particles judges the first, by how far from it the second is.
export function marksOf({ property, marks }) {
  const isPair = property === 'detection' && marks.particles.length === 2;
  return { ...marks, neighbours: isPair ? marks.particles.slice(1) : [] };
}

export const hasPlace = ({ particles, path, members, corners }) => particles.length + path.length + members.length + corners.length > 0;

function listed(numbers) {
  const kMost = 4;
  const said = numbers.slice(0, kMost).map(String);
  if (numbers.length > kMost) said.push(plural(numbers.length - kMost, 'other'));
  return said.length > 1 ? `${said.slice(0, -1).join(', ')} and ${said[said.length - 1]}` : said.join('');
}

// clusters: their numbers, or none where they are not known.
export function markedWords({ particles, path, members, corners, partly, exact, neighbours, joined }, clusters) {
  const said = [];
  const triangles = corners.length / 3;
  if (neighbours.length > 0) said.push('Marked orange: the particle that the verdict names; yellow: its neighbour at the other end of an edge by which it is judged.');
  else if (particles.length + path.length > 0) said.push(`Marked orange: what the verdict names${triangles ? `, ${plural(triangles, 'triangle')} of the skin among it` : ''}.`);
  else if (triangles) said.push(`Marked orange: ${plural(triangles, 'triangle')} of the skin, which the verdict names.`);
  const named = new Set([...particles, ...path]);
  if (members.length > 0) {
    const isYellow = members.some((i) => !named.has(i)), isJoined = joined.some((one) => one.members.length > 1);
    const which = clusters.length === 0 ? 'its clusters' : `${clusters.length === 1 ? 'cluster' : 'clusters'} ${listed(clusters)}`;
    if (isYellow) said.push(`Yellow: the members of ${which}${isJoined ? `; lines join ${joined.length === 1 ? 'them' : 'those of each'}` : ''}.`);
    else if (isJoined) said.push(`Lines join the members of ${which}.`);
  }
  if (said.length === 0) said.push('The verdict marks no place.');
  if (partly) said.push('There are more than are marked.');
  if (!exact) said.push('The recording has no moment after this stage; this is the next one.');
  return said.join(' ');
}
