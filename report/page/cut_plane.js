// A plane that cuts the picture open: where it lies, which way it looks, and how people move it.
import { BufferAttribute, BufferGeometry, LineBasicMaterial, LineLoop, Vector4 } from 'three';
import { byId, element, figure } from './dom.js';

const kFar = 1e9;

export class CutPlane {
  // orientation: of the body, row by row; changed: called when the picture has to be drawn again, with whether the
  // plane was put in or taken out.
  constructor(orientation, changed) {
    this.orientation = orientation;
    this.changed = changed;
    this.isOn = false;
    this.at = 0;         // from the middle of the body along the normal [h]
    this.around = 0;     // of the normal, in degrees: about the upright axis from x, and up from the ground
    this.above = 0;
    this.reach = 1;
    this.uniform = { value: new Vector4(0, 0, 0, kFar) };
    this.outline = new LineLoop(new BufferGeometry(), new LineBasicMaterial({ color: 0x0072b2 }));
    this.outline.geometry.setAttribute('position', new BufferAttribute(new Float32Array(12), 3));
    this.outline.frustumCulled = false;
    this.outline.visible = false;
  }

  // reach: half the size of the body [h].
  begin(reach) {
    this.reach = reach;
    this.apply();
  }

  axes() {
    const a = (this.around * Math.PI) / 180, b = (this.above * Math.PI) / 180;
    const m = this.orientation;
    // In the body's frame: the transpose turns back.
    const turned = (v) => [0, 1, 2].map((k) => m[k] * v[0] + m[3 + k] * v[1] + m[6 + k] * v[2]);
    return [[Math.cos(b) * Math.cos(a), Math.cos(b) * Math.sin(a), Math.sin(b)], [-Math.sin(a), Math.cos(a), 0],
      [-Math.sin(b) * Math.cos(a), -Math.sin(b) * Math.sin(a), Math.cos(b)]].map(turned);
  }

  apply() {
    const [n, u, v] = this.axes();
    this.uniform.value.set(n[0], n[1], n[2], this.at);
    if (!this.isOn) this.uniform.value.set(0, 0, 0, kFar);
    this.outline.visible = this.isOn;
    const corner = this.outline.geometry.attributes.position;
    [[-1, -1], [1, -1], [1, 1], [-1, 1]].forEach(([s, t], k) => corner.array.set([0, 1, 2].map((c) => this.at * n[c] + this.reach * (s * u[c] + t * v[c])), 3 * k));
    corner.needsUpdate = true;
  }

  set(values) {
    const was = this.isOn;
    Object.assign(this, values);
    this.at = Math.min(Math.max(this.at, -this.reach), this.reach);
    this.above = Math.min(Math.max(this.above, -90), 90);
    this.around = ((((this.around + 180) % 360) + 360) % 360) - 180;
    this.apply();
    this.show();
    this.changed(was !== this.isOn);
  }

  move(by) { this.set({ isOn: true, at: this.at + by }); }
  turn(around, above) { this.set({ isOn: true, around: this.around + around, above: this.above + above }); }
  // What lies between the plane and whoever looks is cut away.
  face({ around, above }) { this.set({ isOn: true, around: (around * 180) / Math.PI, above: (above * 180) / Math.PI }); }

  words() {
    return this.isOn ? `Cut open at ${figure(Math.round(10 * this.at) / 10)} h from the middle. The cut face is made of the particles within 2 h behind the plane, because a skin alone is hollow.` : '';
  }

  // orbit: whose view the plane can be turned to.
  controls(orbit) {
    const slider = (id, name, min, max, step, to) => element('label', {}, element('span', { text: name }),
      element('input', { type: 'range', id, min, max, step, value: 0, oninput: (event) => to(Number(event.target.value)) }));
    this.box = element('input', { type: 'checkbox', id: 'cut', onchange: (event) => this.set({ isOn: event.target.checked }) });
    this.more = element('div', { class: 'row cut-controls', id: 'cut-controls', hidden: true },
      slider('cut-at', 'position', -1, 1, 0.005, (share) => this.set({ at: share * this.reach })),
      slider('cut-around', 'around', -180, 180, 5, (around) => this.set({ around })),
      slider('cut-above', 'up', -90, 90, 5, (above) => this.set({ above })),
      element('button', { type: 'button', class: 'quiet', id: 'cut-face', text: 'Towards me', onclick: () => this.face(orbit.at) }));
    return [element('label', {}, this.box, element('span', { text: 'cut open' })), this.more];
  }

  show() {
    if (!this.box) return;
    this.box.checked = this.isOn;
    this.more.hidden = !this.isOn;
    byId('cut-at').value = this.at / this.reach;
    byId('cut-around').value = this.around;
    byId('cut-above').value = this.above;
  }

  // True if the key is the plane's.
  key(event) {
    const turns = { ArrowLeft: [-5, 0], ArrowRight: [5, 0], ArrowUp: [0, 5], ArrowDown: [0, -5] }[event.key];
    if (event.altKey && turns) this.turn(...turns);
    else if (event.ctrlKey || event.altKey || event.metaKey) return false;
    else if (event.key === 'c') this.set({ isOn: !this.isOn });
    else if (event.key === '[') this.move(-this.reach / 40);
    else if (event.key === ']') this.move(this.reach / 40);
    else return false;
    return true;
  }
}
