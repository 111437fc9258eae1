// Both runs of a counterexample, side by side: the backend's and the reference's, at the same moment.
import { Moments } from './coding.js';
import { colourings } from './colours.js';
import { byId, element, plural } from './dom.js';
import { markedWords, marksOf } from './marks.js';
import { View, contextOf } from './view.js';

const words = (moment) => (moment.start ? 'As loaded' : `Frame ${moment.frame}, after ${moment.stage}`);

// The moment of another run that is nearest to one of this.
function sameMoment(moments, like) {
  let best = 0, apart = Infinity;
  moments.forEach((moment, k) => {
    if (moment.start !== like.start) return;
    const far = Math.abs(moment.frame - like.frame) * 10 + (moment.stage === like.stage ? 0 : 1);
    if (far <= apart) [best, apart] = [k, far];
  });
  return best;
}

// One place of the page for all of them: a browser has few contexts of WebGL.
export class Sceneries {
  constructor(sceneries) {
    this.sceneries = sceneries;
    this.panes = element('div', { class: 'panes' });
    this.status = element('p', { id: 'status' });
    this.witness = element('p', { id: 'witness', role: 'status' });
    this.range = element('input', { type: 'range', id: 'scrub', min: 0, step: 1, 'aria-label': 'Moment of both runs', oninput: () => this.go(Number(this.range.value)) });
    const button = (text, name, by) => element('button', { type: 'button', text, 'aria-label': name, title: name, onclick: () => this.go(this.at + by) });
    this.skin = element('select', { id: 'show', onchange: () => this.go(this.at) }, element('option', { value: 'particles', text: 'particles' }), element('option', { value: 'skin', text: 'skin' }), element('option', { value: 'both', text: 'both' }));
    this.colour = element('select', { id: 'colour', onchange: () => { this.isChosen = true; this.go(this.at); } }, ...Object.entries(colourings(false, null)).map(([key, one]) => element('option', { value: key, text: one.name })));
    this.fails = element('button', { type: 'button', text: 'Where it fails', onclick: () => this.show(this.number) });
    this.legend = element('p', { id: 'legend', class: 'small' });
    this.section = element('section', { id: 'view', class: 'card', 'aria-labelledby': 'view-title' },
      element('h2', { id: 'view-title' }), this.panes,
      element('div', { class: 'player' }, this.range, element('div', { class: 'row' }, button('‹ Stage', 'Previous stage', -1), button('Stage ›', 'Next stage', 1), this.fails,
        element('label', {}, element('span', { text: 'Show' }), this.skin), element('label', {}, element('span', { text: 'Colour' }), this.colour))),
      this.status, this.witness, this.legend);
  }

  async show(number) {
    const scenery = this.sceneries[number];
    const [first] = scenery.sides;
    if (this.number !== number) {
      this.number = number;
      for (const one of this.views || []) one.view && one.view.renderer.dispose();
      byId('view-title').textContent = scenery.property || 'It holds now';
      this.views = [];
      this.panes.replaceChildren();
      for (const side of scenery.sides) {
        const canvas = element('canvas', { tabindex: 0, role: 'application', 'aria-label': `3D view of ${side.name}. Arrow keys turn it, plus and minus come nearer and go away, 0 goes back.` });
        const place = element('div', { class: 'canvas' }, canvas);
        this.panes.append(element('figure', { class: 'pane' }, element('figcaption', { text: side.name }), place));
        const context = contextOf(canvas);
        if (!context) place.replaceChildren(element('p', { class: 'nothing no-webgl', text: 'This browser shows no 3D view (WebGL is not there). Everything else on this page works.' }));
        const moments = new Moments(side.firstMoment, 'chunk', side.firstChunk);
        const begin = side.moments.length ? await moments.chunk(0) : null;
        if (this.number !== number) return;
        const view = context && begin && new View(canvas, context, { body: scenery.body, blade: scenery.blade, reach: side.reach });
        if (view) view.begin(begin.moment(0), begin.edges || null);
        this.views.push({ view, side, moments });
      }
      this.range.max = first.moments.length - 1;
      this.fails.hidden = !scenery.property;
      // Where a cluster is what is wrong, the two may differ in nothing else.
      if (!this.isChosen) this.colour.value = scenery.sides.some((side) => side.marks && side.marks.members.length > 0) ? 'cluster' : 'piece';
    }
    await this.go(scenery.property && first.marks ? Math.max(first.marks.moment, 0) : first.moments.length - 1);
    // From one side, as far as they can be compared.
    let place;
    for (const { view } of this.views) if (view) place = view.flyToMarks(place || undefined);
  }

  async go(at) {
    const scenery = this.sceneries[this.number];
    const { moments, marks } = scenery.sides[0];
    this.at = Math.min(Math.max(at, 0), moments.length - 1);
    const moment = moments[this.at];
    this.range.value = this.at;
    this.range.setAttribute('aria-valuetext', words(moment));
    const isWhere = Boolean(scenery.property) && marks && marks.moment === this.at;
    const look = { skin: this.skin.value !== 'particles', particles: this.skin.value !== 'skin', removed: true, colouring: colourings(false, null)[this.colour.value] };
    const said = [], ticket = (this.ticket = (this.ticket || 0) + 1);
    for (const { view, side, moments: own } of this.views) {
      const k = side === scenery.sides[0] ? this.at : sameMoment(side.moments, moment);
      said.push(`${side.name}: ${plural(side.moments[k].components, 'piece')}, ${plural(side.moments[k].clusters, 'cluster')}, ${plural(side.moments[k].particles, 'particle')}`);
      // Particles are the same ones in both runs; clusters and vertices of the skin need not be: of the other run its
      // own cluster of the same number.
      const theirs = side.marks && side.marks.moment === k ? side.marks : { members: [], joined: [] };
      const marked = isWhere && marksOf({ property: scenery.property, marks: side === scenery.sides[0] ? marks : { ...marks, members: theirs.members, joined: theirs.joined, corners: [] } });
      if (view) {
        const arrays = await own.get(k);
        if (ticket !== this.ticket) return;  // somebody has gone on meanwhile
        const { words: legend } = view.show([arrays], [side.moments[k]], look, marked || null);
        const isFirst = side === scenery.sides[0];
        if (isFirst) this.legend.textContent = `${legend} Removed particles are rings.${marked ? ` ${markedWords(marked, marked.joined.map((one) => one.number))}` : ''}`;
        if (isFirst && this.skin.value === 'skin' && arrays.triangles.length === 0) this.legend.textContent += ' This moment has no skin, so particles are shown.';
      }
    }
    this.status.replaceChildren(element('strong', { text: words(moment) }), element('span', { class: 'muted', text: ` · ${said.join(' · ')}` }));
    this.witness.textContent = isWhere ? `${scenery.property} fails here: ${scenery.text}` : '';
    document.documentElement.dataset.scenery = `${this.number}/${this.at}`;
  }
}
