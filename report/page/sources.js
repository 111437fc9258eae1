// Where a bound comes from, with what stands there: a section's number says nothing to whoever has this page alone.
// Titles as in docs/design/method.md, which the tests hold them against.
const kSections = ['tissue graph', 'clusters', 'one substep', 'cut detection', 'split', 'merge', 'expand', 'skin',
  'frame', 'scenes of the paper', 'acceleration', 'rotations', 'groups'];

export function sourceInWords(source) {
  return source.replace(/(method\.md §)(\d+)(?: to §(\d+))?/g, (all, name, from, to) => {
    const first = kSections[from - 1], last = to && kSections[to - 1];
    return first ? `${all} (${first}${last ? ` to ${last}` : ''})` : all;
  });
}
