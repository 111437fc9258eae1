// Two recordings beside each other: in what they differ first, and how far apart they are.
import { element, figure, plural } from './dom.js';

// A difference of somebody else's runs, whose clusters are coupling groups.
const named = (differs, isForeign) => (isForeign ? differs.replace('clusters', 'coupling groups') : differs);
const far = (max) => (typeof max === 'number' ? `${figure(max)} h` : 'infinitely far: one of them is no number');

// jump(frame, stage): goes to that moment, and shows the distance there. Frames of somebody else's have no stages.
export function comparisonCard(comparison, isForeign, jump) {
  const when = (one) => (one.frame < 0 ? 'as loaded' : `in frame ${one.frame}${isForeign ? '' : ` after ${one.stage}`}`);
  const { any, decision, greatest, compared, name, ownName } = comparison;
  const go = (one, text, id) => element('button', { type: 'button', class: 'finding', id, text, onclick: () => jump(one.frame, one.stage) });
  const said = [];
  if (compared === 0) said.push(element('p', { text: `${ownName} and ${name} have no moment in common.` }));
  else if (!any) said.push(element('p', { id: 'first-apart', text: `In all ${plural(compared, 'moment')} that both hold, positions, ${isForeign ? 'coupling groups' : 'clusters'} and skin are the same.` }));
  else {
    said.push(element('p', { id: 'first-apart', text: `They differ first ${when(any)}: ${named(any.differs, isForeign)}${any.max ? `, by up to ${far(any.max)}` : ''}.` }));
    const buttons = [go(any, 'Show me: the first difference', 'to-first-apart')];
    if (!decision) said.push(element('p', { text: isForeign ? 'In all of them the same particles are there.' : 'In all of them the same particles are there, in the same clusters, under the same triangles.' }));
    else if (decision.frame !== any.frame || decision.stage !== any.stage) {
      said.unshift(element('p', { text: `They decide differently first ${when(decision)}: ${named(decision.differs, isForeign)}.` }));
      buttons.unshift(go(decision, 'Show me: the first decision', 'to-first-decision'));
    }
    if (greatest) {
      said.push(element('p', { text: `They are farthest apart ${when(greatest)}: ${far(greatest.max)}.` }));
      buttons.push(go(greatest, 'Show me: the farthest', 'to-farthest'));
    }
    said.push(element('div', { class: 'row' }, ...buttons));
  }
  return element('article', { class: 'card beside', id: 'comparison' },
    element('h3', {}, element('span', { text: comparison.shown ? `${ownName} beside ${name}` : `Distance to ${name}` })), ...said,
    element('p', { class: 'muted small', text: `Distance: from each particle to ${comparison.obtained}. Positions are compared as they were recorded, before the page rounds them.` }));
}

// What a moment's line says of the distance; empty where there is nothing to say.
export function apartInWords(comparison, about, isForeign) {
  if (!comparison) return '';
  if (!about.apart) return comparison.shown ? 'no counterpart in the other' : '';
  const { max, rms, differs } = about.apart;
  if (!differs) return comparison.shown ? 'both the same' : `as ${comparison.name} has it`;
  const where = about.apart.particle >= 0 && max !== 0 ? `apart by up to ${far(max)} (particle ${about.apart.particle}), RMS ${typeof rms === 'number' ? figure(rms) : '∞'} h` : '';
  return [where, differs === 'positions' ? '' : `different: ${named(differs, isForeign)}`].filter(Boolean).join('; ');
}
