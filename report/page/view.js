// The 3D view: one run, or two beside each other, seen by one camera. Lengths are in h, the middle of the body is 0.
import { Color, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from 'three';
import { places } from './coding.js';
import { CutPlane } from './cut_plane.js';
import { Orbit } from './orbit.js';
import { Tissue } from './tissue.js';

// A run that needs the camera so many times farther away than the body as it began is not fitted as a whole.
const kFarthest = 2;
// A body of fewer particles is small. Beside what is marked, the view's middle lies so far towards that of the body.
const kSmallBody = 1000, kTowardsMiddle = 0.3;
// From the pointer to a particle that it means.
const kNearPixels = 8;

// While somebody scrubs, plays or turns where pictures take long: a picture of so many times fewer pixels along each
// side now rather than a sharp one later, of the next as many if a few in a row take too long; and a sharp one after so
// long a rest.
const kQuickShares = [0.5, 0.35, 0.25], kTooLong = 65, kInARow = 3, kRest = 180, kLong = 50;

// Null where there is no WebGL. three.js asks for none but says so in the console; so it is asked for here.
export function contextOf(canvas) {
  // Where the processor draws, smooth edges cost more than all else, and nobody scrubs fluently.
  const trial = document.createElement('canvas').getContext('webgl');
  const named = trial && trial.getExtension('WEBGL_debug_renderer_info');
  const drawer = named ? trial.getParameter(named.UNMASKED_RENDERER_WEBGL) : '';
  const isSoftware = /swiftshader|llvmpipe|software|basic render/i.test(drawer);
  if (trial && trial.getExtension('WEBGL_lose_context')) trial.getExtension('WEBGL_lose_context').loseContext();
  const wanted = { alpha: false, antialias: !isSoftware, depth: true, stencil: false, preserveDrawingBuffer: true };
  const context = canvas.getContext('webgl2', wanted) || canvas.getContext('webgl', wanted);
  return context && { context, isSoftware };
}

const cornersOf = (low, high) => Array.from({ length: 8 }, (_, corner) => [0, 1, 2].map((k) => ((corner >> k) & 1 ? high : low)[k]));

export class View {
  constructor(canvas, { context, isSoftware }, data) {
    this.data = data;
    this.canvas = canvas;
    this.isSlow = isSoftware;
    canvas.parentElement.classList.toggle('plain', isSoftware);
    this.isQuick = false;
    this.coarse = 0;  // index into kQuickShares
    this.late = 0;    // quick pictures in a row that took too long
    this.renderer = new WebGLRenderer({ canvas, context });
    this.renderer.autoClear = false;
  
    this.scene = new Scene();
    this.plane = new CutPlane(data.body.orientation, () => this.draw());
    const sides = data.comparison && data.comparison.shown ? 2 : 1;
    this.sides = [data.moments, data.besideMoments].slice(0, sides).map((moments) => new Tissue(data, moments, this.plane.uniform));
    for (const { body } of this.sides) this.scene.add(body);
    this.camera = new PerspectiveCamera(32, 1, 0.1, 1000);
    this.camera.up.set(0, 0, 1);
    this.orbit = new Orbit(canvas, this.camera, () => { this.hurry(); this.draw(); });
    this.orbit.beforeHome = () => this.fitHome();
    this.orbit.onAltDrag = (dx, dy, isTurn) => (isTurn ? this.plane.turn(dx * 0.5, -dy * 0.5) : this.plane.move(-dy * this.plane.reach * 0.01));
    if (data.body.kept === data.body.particles) canvas.addEventListener('pointermove', (event) => { if (!event.buttons) this.tell(event.offsetX, event.offsetY); });
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
    addEventListener('beforeprint', () => this.render());
  }

  // Around what the first moment shows.
  begin(moment, edges) {
    const spacing = this.data.body.spacing || 1;
    const points = moment.x.length ? moment.x : moment.skin;
    const raw = places(points, moment, [0, 0, 0], 1);
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < raw.length; ++i) {
      if (raw[i] < low[i % 3]) low[i % 3] = raw[i];
      if (raw[i] > high[i % 3]) high[i % 3] = raw[i];
    }
    this.centre = low.map((x, k) => (x <= high[k] ? (x + high[k]) / 2 : 0));
    this.extent = low.map((x, k) => (x <= high[k] ? (high[k] - x) / spacing : 1));
    this.radius = Math.hypot(...this.extent) / 2 + 1;
    this.start = places(moment.x, moment, this.centre, spacing);
    this.edges = edges;
    this.first = moment;
    this.plane.begin(this.radius);
    for (const side of this.sides) side.body.add(side.outline = this.plane.outline.clone());
    this.resize();
    this.orbit.at = { ...this.orbit.home, target: [...this.orbit.home.target] };
    this.orbit.place();
  }

  // So far away that a ball of this radius fills the view.
  distanceFor(radius) {
    const half = (this.camera.fov * Math.PI) / 360;
    const across = Math.atan(Math.tan(half) * Math.min(this.camera.aspect, 1));
    return radius / Math.sin(across);
  }

  // As the body is turned.
  turned(p) {
    const m = this.data.body.orientation;
    return [0, 3, 6].map((k) => m[k] * p[0] + m[k + 1] * p[1] + m[k + 2] * p[2]);
  }

  // Corners of the box of all that is alive at the end of any frame, and of the body as it began.
  cornersOfRun() {
    const spacing = this.data.body.spacing || 1;
    const [low, high] = this.data.reach.map((end, side) => end.map((x, k) => {
      const run = (x - this.centre[k]) / spacing, half = this.extent[k] / 2;
      return side === 0 ? Math.min(run, -half) : Math.max(run, half);
    }));
    return cornersOf(low, high);
  }

  // From where the whole run fills the view; what has flown far away does not count, and the view goes along with
  // somebody else's run.
  fitHome() {
    const from = (target, points) => this.distanceFrom(target, points.map((p) => this.turned(p)));
    const begun = [], spacing = this.data.body.spacing || 1;
    const every = 3 * Math.max(1, Math.floor(this.start.length / 30000));
    for (let i = 0; i < this.start.length; i += every) {
      if (!Number.isNaN(this.start[i])) begun.push(this.start.subarray(i, i + 3));
    }
    const home = this.orbit.home, begins = 1.12 * from([0, 0, 0], begun);
    home.distance = begins;
    if (this.data.foreign) {
      // Around the middle of the moment that is shown, which the view follows; the other run may be elsewhere.
      const abouts = (this.abouts || [this.data.moments[0], ...(this.data.besideMoments || []).slice(0, 1)]).filter((about) => about.half);
      if (abouts.length === 0) return;
      const end = (about, sign) => about.middle.map((x, k) => (x - abouts[0].middle[k] + sign * about.half[k]) / spacing);
      home.distance = Math.max(begins, 0.93 * from([0, 0, 0], abouts.flatMap((about) => cornersOf(end(about, -1), end(about, 1)))));
      return;
    }
    const corners = this.cornersOfRun();
    const middle = this.turned([0, 1, 2].map((k) => (corners[0][k] + corners[7][k]) / 2));
    // Little of a box lies at its corners.
    const all = Math.max(0.88 * from(middle, corners), from(middle, begun));
    if (all > kFarthest * begins) return;
    home.target = middle;
    home.distance = 1.06 * all;
  }

  // How far away the camera must be from the target for all of these points to be seen.
  distanceFrom(target, points) {
    const { around, above } = this.orbit.home;
    const up = Math.tan((this.camera.fov * Math.PI) / 360), across = up * this.camera.aspect;
    let most = 1;
    for (const p of points) {
      const [x, y, z] = p.map((c, k) => c - target[k]);
      const out = x * Math.cos(around) + y * Math.sin(around);
      const right = Math.abs(-x * Math.sin(around) + y * Math.cos(around)) + 1;
      const high = Math.abs(z * Math.cos(above) - out * Math.sin(above)) + 1;
      most = Math.max(most, Math.max(right / across, high / up) + out * Math.cos(above) + z * Math.sin(above));
    }
    return most;
  }

  // Where each run is drawn, in pixels of the page from the lower left: beside each other, or one above the other in a
  // view that is narrow.
  parts() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (this.sides.length === 1) return [[0, 0, width, height]];
    if (width >= height) return [[0, 0, width / 2 - 1, height], [width / 2 + 1, 0, width / 2 - 1, height]];
    return [[0, height / 2 + 1, width, height / 2 - 1], [0, 0, width, height / 2 - 1]];
  }

  resize() {
    if (this.canvas.clientWidth === 0 || !this.centre) return;
    this.resizeBuffer();
    const [, , width, height] = this.parts()[0];
    this.camera.aspect = width / height;
    const was = this.orbit.home.distance;
    this.fitHome();
    this.orbit.at.distance *= this.orbit.home.distance / was;
    this.orbit.place();
    this.render();  // at once: a canvas of another size is empty
  }

  setQuick(isQuick) {
    if (isQuick === this.isQuick) return;
    this.isQuick = isQuick;
    this.late = 0;
    this.resizeBuffer();
    this.draw();
  }

  resizeBuffer() {
    const { clientWidth, clientHeight } = this.canvas;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2) * (this.isQuick ? kQuickShares[this.coarse] : 1));
    this.renderer.setSize(clientWidth, clientHeight, false);
  }

  // A quick picture took so long, from when it was asked of the GPU to when the browser came to the next.
  took(milliseconds) {
    this.late = milliseconds > kTooLong ? this.late + 1 : 0;
    if (this.late < kInARow || this.coarse === kQuickShares.length - 1) return;
    this.late = 0;
    ++this.coarse;
    this.resizeBuffer();
    this.draw();  // a canvas of another size is empty
  }

  // Somebody wants the next pictures soon.
  hurry() {
    if (!this.isSlow || !this.centre) return;
    this.setQuick(true);
    this.restLater();
  }

  // Nobody rests while what they want is on its way: a sharp picture in between costs more than many quick ones.
  restLater() {
    clearTimeout(this.rest);
    this.rest = setTimeout(() => (this.isDue || this.isDrawing || this.isAwaited ? this.restLater() : this.setQuick(false)), kRest);
  }

  draw() {
    if (this.isDue) return;
    this.isDue = true;
    this.canvas.dataset.drawn = 'due';
    const asked = performance.now();
    requestAnimationFrame(() => {
      if (this.isDue) this.render();
      this.isDrawing = true;
      const begun = performance.now();
      // A machine that needs long for a picture says so by when it comes to the next.
      requestAnimationFrame(() => {
        this.isDrawing = false;
        if (performance.now() - asked > 3 * kLong) this.isSlow = true;
        if (!this.isQuick) return;
        this.took(performance.now() - begun);
        this.restLater();
      });
    });
  }

  render() {
    this.isDue = false;
    if (!this.centre) return;
    const style = getComputedStyle(this.canvas.parentElement);
    const back = new Color(style.backgroundColor);
    const parts = this.parts();
    const ratio = this.renderer.getPixelRatio();
    const perPixel = (parts[0][3] * ratio / 2) / Math.tan((this.camera.fov * Math.PI) / 360);
    this.renderer.setScissorTest(false);
    this.renderer.setClearColor(this.sides.length > 1 ? new Color(style.borderTopColor) : back);
    this.renderer.clear();
    this.sides.forEach((side, k) => {
      for (const points of side.points()) {
        points.material.uniforms.perPixel.value = perPixel;
        points.material.uniforms.back.value.copy(back);
      }
      this.sides.forEach((other) => { other.body.visible = other === side; });
      const part = parts[k];
      this.renderer.setViewport(...part);
      if (this.sides.length > 1) {
        this.renderer.setScissor(...part);
        this.renderer.setScissorTest(true);
        this.renderer.setClearColor(back);
        this.renderer.clear();
      }
      side.outline.visible = this.plane.isOn;
      this.renderer.render(this.scene, this.camera);
    });
    this.canvas.dataset.drawn = this.isQuick ? 'quick' : 'sharp';
  }

  // The number of the particle in front at a place of the canvas, as its title.
  tell(x, y) {
    const { clientHeight } = this.canvas, at = new Vector3();
    const k = Math.max(this.parts().findIndex(([left, below, width, height]) => x >= left && x < left + width && clientHeight - y >= below && clientHeight - y < below + height), 0);
    const [left, below, width, height] = this.parts()[k], { shown, body } = this.sides[k];
    if (!shown) return;
    const xyz = shown.places();
    let found = -1, nearest = Infinity;
    for (let i = 0; i < shown.alive.length; ++i) {
      if (!shown.alive[i]) continue;
      at.fromArray(xyz, 3 * i).applyMatrix4(body.matrixWorld).project(this.camera);
      const off = Math.hypot(left + (at.x + 1) * width / 2 - x, below + (at.y + 1) * height / 2 - (clientHeight - y));
      if (off < kNearPixels && at.z < nearest) [found, nearest] = [i, at.z];
    }
    this.canvas.title = found < 0 ? '' : `particle ${found}`;
  }

  // moments: of each run its arrays; abouts: what the page says of them. Returns the legend, of the first.
  show(moments, abouts, look, marks) {
    const about = { centre: this.centre, start: this.start, edges: this.edges, first: this.first };
    const seen = { ...look, way: look.way && !marks && !this.plane.isOn, isCut: this.plane.isOn };
    const { middle } = abouts[0], spacing = this.data.body.spacing || 1;
    if (this.data.foreign && middle) this.orbit.follow(middle.map((x, k) => (x - this.centre[k]) / spacing));
    const legends = this.sides.map((side, k) => side.show(moments[k], abouts[k], seen, k === 0 || this.data.foreign ? marks : null, about));
    this.abouts = abouts;
    this.draw();
    return legends[0];
  }

  // Flies to what is marked, if anything is; or to where another view has flown.
  flyToMarks(place = this.placeOfMarks()) {
    if (place) this.orbit.fly(...place);
    return place;
  }

  // Where to look, from how far away, and from where if that matters.
  placeOfMarks() {
    const { marked } = this.sides[0];
    if (!marked || marked.length === 0) return null;
    const m = this.data.body.orientation;
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < marked.length; i += 3) {
      const [x, y, z] = marked.slice(i, i + 3);
      for (let k = 0; k < 3; ++k) {
        const c = m[3 * k] * x + m[3 * k + 1] * y + m[3 * k + 2] * z;
        if (c < low[k]) low[k] = c;
        if (c > high[k]) high[k] = c;
      }
    }
    const radius = Math.hypot(...low.map((x, k) => high[k] - x)) / 2;
    const middle = low.map((x, k) => (x + high[k]) / 2);
    const isTriangle = this.sides[0].facing !== null, angles = isTriangle ? this.anglesFacing(this.sides[0].facing) : undefined;
    // A small body is seen whole.
    if (this.data.foreign) this.fitHome();
    if (this.data.body.particles < kSmallBody) return [this.orbit.home.target, this.orbit.home.distance, angles];
    // Never so near that nobody sees where in the body it is; a triangle of the skin is small.
    const seen = Math.min(this.radius, Math.max(1.8 * radius + 2, this.radius * (isTriangle ? 0.3 : 0.5)));
    // Marks at the rim would leave half of the view empty.
    const target = middle.map((x, k) => x + kTowardsMiddle * (this.orbit.middle[k] - x));
    return [target, this.distanceFor(seen), angles];
  }

  // The angles from which a surface is seen that faces this way. Not from straight above or
  // below, where nobody knows which way they look.
  anglesFacing(facing) {
    const m = this.data.body.orientation;
    const [x, y, z] = [0, 3, 6].map((k) => m[k] * facing[0] + m[k + 1] * facing[1] + m[k + 2] * facing[2]);
    const flat = Math.hypot(x, y);
    const limit = (angle) => Math.min(Math.max(angle, -1.2), 1.2);
    let around = flat > 1e-3 ? Math.atan2(y, x) : this.orbit.at.around;
    // The shorter way round.
    while (around - this.orbit.at.around > Math.PI) around -= 2 * Math.PI;
    while (around - this.orbit.at.around < -Math.PI) around += 2 * Math.PI;
    return { around, above: limit(Math.atan2(z, flat)) };
  }
}
