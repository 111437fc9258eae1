// The 3D view: particles, skin, blade, and what a verdict names. Lengths are in h, the middle of the body is 0.
import {
  BoxBufferGeometry, BufferAttribute, BufferGeometry, Color, DoubleSide, EdgesGeometry, Group, Line, LineBasicMaterial,
  LineSegments, Matrix4, Mesh, PerspectiveCamera, Points, Scene, ShaderMaterial, Vector3, WebGLRenderer,
} from 'three';
import { places } from './coding.js';
import { kTissue } from './colours.js';
import { Orbit } from './orbit.js';

const kLight = 'vec3 light(vec3 colour, vec3 n) { float lit = 0.42 + 0.58 * max(dot(n, normalize(vec3(0.35, 0.5, 0.8))), 0.0); return colour * lit; }';

// Balls as discs that face the camera. kind: 0 nothing, 1 alive, 2 removed, 3 and 4 marked.
const pointShader = (inFront) => ({
  uniforms: { perPixel: { value: 1 }, size: { value: 0.95 }, fade: { value: 0 }, back: { value: new Color() } },
  vertexShader: `attribute vec3 tint; attribute float kind; uniform float perPixel, size; varying vec3 colour; varying float which;
    void main() {
      vec4 place = modelViewMatrix * vec4(position, 1.0);
      gl_Position = kind < 0.5 ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * place;
      float share = kind > 2.5 ? (kind > 3.5 ? 1.6 : 1.15) : kind > 1.5 ? 0.55 : 1.0;
      gl_PointSize = max(size * share * perPixel / -place.z, kind > 2.5 ? 9.0 : 1.5);
      colour = tint; which = kind;
    }`,
  fragmentShader: `${kLight} uniform vec3 back; uniform float fade; varying vec3 colour; varying float which;
    void main() {
      vec2 p = 2.0 * gl_PointCoord - 1.0; float r = dot(p, p);
      if (r > 1.0 || (which > 1.5 && which < 2.5 && r < 0.4)) discard;
      vec3 n = vec3(p.x, -p.y, sqrt(max(1.0 - r, 0.0)));
      vec3 lit = light(colour, n);
      if (which > 2.5) lit = r > 0.66 ? vec3(0.07) : mix(lit, colour, 0.5);
      else if (r > 0.8) lit *= 0.8;
      gl_FragColor = vec4(mix(lit, back, which > 2.5 ? 0.0 : fade), 1.0);
    }`,
  depthTest: !inFront, transparent: inFront,
});

const skinShader = () => ({
  uniforms: { fade: { value: 1 } },
  vertexShader: `attribute vec3 tint; varying vec3 colour, turned;
    void main() { colour = tint; turned = normalMatrix * normal; gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); }`,
  fragmentShader: `${kLight} uniform float fade; varying vec3 colour, turned;
    void main() {
      vec3 n = normalize(turned); float side = gl_FrontFacing ? 1.0 : -1.0;
      vec3 lit = light(gl_FrontFacing ? colour : colour * 0.6, n * side);
      gl_FragColor = vec4(lit, fade);
    }`,
  side: DoubleSide, transparent: true,
});

function normals(xyz, triangles) {
  const found = new Float32Array(xyz.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const [a, b, c] = [3 * triangles[t], 3 * triangles[t + 1], 3 * triangles[t + 2]];
    const ux = xyz[b] - xyz[a], uy = xyz[b + 1] - xyz[a + 1], uz = xyz[b + 2] - xyz[a + 2];
    const vx = xyz[c] - xyz[a], vy = xyz[c + 1] - xyz[a + 1], vz = xyz[c + 2] - xyz[a + 2];
    const n = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    for (const corner of [a, b, c]) for (let k = 0; k < 3; ++k) found[corner + k] += n[k];
  }
  return found;
}

const kMarked = [0.84, 0.37, 0.0], kMember = [0.94, 0.89, 0.26];

// Null where there is no WebGL. three.js asks for none but says so in the console; so it is asked for here.
export function contextOf(canvas) {
  // Where the processor draws, smooth edges cost more than all else, and nobody scrubs fluently.
  const trial = document.createElement('canvas').getContext('webgl');
  const named = trial && trial.getExtension('WEBGL_debug_renderer_info');
  const drawer = named ? trial.getParameter(named.UNMASKED_RENDERER_WEBGL) : '';
  const antialias = !/swiftshader|llvmpipe|software|basic render/i.test(drawer);
  if (trial && trial.getExtension('WEBGL_lose_context')) trial.getExtension('WEBGL_lose_context').loseContext();
  const wanted = { alpha: false, antialias, depth: true, stencil: false, preserveDrawingBuffer: true };
  return canvas.getContext('webgl2', wanted) || canvas.getContext('webgl', wanted);
}

export class View {
  constructor(canvas, context, data) {
    this.data = data;
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, context });
    this.scene = new Scene();
    this.body = new Group();
    this.scene.add(this.body);
    const m = data.body.orientation;
    this.body.matrixAutoUpdate = false;
    this.body.matrix = new Matrix4().set(m[0], m[1], m[2], 0, m[3], m[4], m[5], 0, m[6], m[7], m[8], 0, 0, 0, 0, 1);
    this.camera = new PerspectiveCamera(32, 1, 0.1, 1000);
    this.camera.up.set(0, 0, 1);
    this.orbit = new Orbit(canvas, this.camera, () => this.draw());
    const points = (inFront) => {
      const found = new Points(new BufferGeometry(), new ShaderMaterial(pointShader(inFront)));
      found.frustumCulled = false;
      this.body.add(found);
      return found;
    };
    this.skin = new Mesh(new BufferGeometry(), new ShaderMaterial(skinShader()));
    this.skin.frustumCulled = false;
    this.body.add(this.skin);
    this.particles = points(false);
    this.blade = new Group();
    this.body.add(this.blade);
    this.path = new Line(new BufferGeometry(), new LineBasicMaterial({ color: 0xd55e00, depthTest: false }));
    this.path.frustumCulled = false;
    this.path.renderOrder = 2;
    this.body.add(this.path);
    this.marks = points(true);
    this.marks.renderOrder = 3;
    if (data.blade) this.makeBlade();
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.draw());
    addEventListener('beforeprint', () => this.render());
  }

  makeBlade() {
    const h = this.data.body.spacing;
    const [length, depth, thickness] = this.data.blade.map((x) => x / h);
    const box = new BoxBufferGeometry(length, Math.max(thickness, 0.05), depth);
    box.translate(0, 0, depth / 2);
    const steel = new ShaderMaterial(skinShader());
    steel.uniforms.fade.value = 0.36;
    steel.depthWrite = false;
    const tint = new Float32Array(box.attributes.position.count * 3);
    for (let i = 0; i < tint.length; i += 3) tint.set([0.72, 0.8, 0.88], i);
    box.setAttribute('tint', new BufferAttribute(tint, 3));
    const plate = new Mesh(box, steel);
    plate.renderOrder = 1;
    this.blade.add(plate, new LineSegments(new EdgesGeometry(box), new LineBasicMaterial({ color: 0x5a6b7b })));
    this.blade.matrixAutoUpdate = false;
  }

  // Around what the first moment shows.
  begin(moment) {
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
    this.resize();
    this.orbit.at = { ...this.orbit.home, target: [0, 0, 0] };
    this.orbit.place();
  }

  // So far away that a ball of this radius fills the view.
  distanceFor(radius) {
    const half = (this.camera.fov * Math.PI) / 360;
    const across = Math.atan(Math.tan(half) * Math.min(this.camera.aspect, 1));
    return radius / Math.sin(across);
  }

  // So far away that the body, as it began, fills the view.
  distanceForAll() {
    const { around, above } = this.orbit.home;
    const up = Math.tan((this.camera.fov * Math.PI) / 360), across = up * this.camera.aspect;
    const m = this.data.body.orientation;
    let most = 1;
    const add = (p) => {
      const [x, y, z] = [0, 3, 6].map((k) => m[k] * p[0] + m[k + 1] * p[1] + m[k + 2] * p[2]);
      const out = x * Math.cos(around) + y * Math.sin(around);
      const right = Math.abs(-x * Math.sin(around) + y * Math.cos(around)) + 1;
      const high = Math.abs(z * Math.cos(above) - out * Math.sin(above)) + 1;
      most = Math.max(most, Math.max(right / across, high / up) + out * Math.cos(above) + z * Math.sin(above));
    };
    const every = 3 * Math.max(1, Math.floor(this.start.length / 30000));
    for (let i = 0; i < this.start.length; i += every) {
      if (!Number.isNaN(this.start[i])) add(this.start.subarray(i, i + 3));
    }
    // With room for the blade; and for what moves, unless the body would become small for it.
    const begins = 1.12 * most;
    const spacing = this.data.body.spacing || 1;
    for (let corner = 0; corner < 8; ++corner) {
      add([0, 1, 2].map((k) => (this.data.reach[(corner >> k) & 1][k] - this.centre[k]) / spacing));
    }
    return Math.min(Math.max(begins, 0.85 * most), 1.4 * begins);
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0 || !this.centre) return;
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    const was = this.orbit.home.distance;
    this.orbit.home.distance = this.distanceForAll();
    this.orbit.at.distance *= this.orbit.home.distance / was;
    this.orbit.place();
  }

  draw() {
    if (this.isDue) return;
    this.isDue = true;
    requestAnimationFrame(() => this.render());
  }

  render() {
    this.isDue = false;
    if (!this.centre) return;
    const back = getComputedStyle(this.canvas.parentElement).backgroundColor;
    this.renderer.setClearColor(new Color(back));
    const perPixel = (this.renderer.domElement.height / 2) / Math.tan((this.camera.fov * Math.PI) / 360);
    for (const points of [this.particles, this.marks]) {
      points.material.uniforms.perPixel.value = perPixel;
      points.material.uniforms.back.value.set(back);
    }
    this.renderer.render(this.scene, this.camera);
  }

  static set(geometry, name, array, size) {
    const old = geometry.attributes[name];
    if (old && old.array.length === array.length) {
      old.array.set(array);
      old.needsUpdate = true;
    } else {
      geometry.setAttribute(name, new BufferAttribute(array, size));
    }
  }

  // moment: its arrays; blade: edge, along, back, or null; look: {skin, particles, removed, colouring}; marks: of a
  // finding, or null. Returns the legend.
  show(moment, blade, look, marks, edges) {
    const spacing = this.data.body.spacing || 1;
    const xyz = places(moment.x, moment, this.centre, spacing);
    const n = xyz.length / 3;
    const hasSkin = look.skin && moment.triangles.length > 0;
    // A moment without a skin, as the start is, shows particles rather than nothing.
    const hasParticles = look.particles || !hasSkin;
    const { colour, words, scale } = look.colouring.of({ moment, xyz, start: this.start, edges });
    const hidden = hasParticles ? this.enclosed(moment, edges) : new Uint8Array(n);
    const tint = new Float32Array(3 * n), kind = new Float32Array(n);
    for (let i = 0; i < n; ++i) {
      tint.set(moment.alive[i] ? colour(i) : [0.45, 0.45, 0.45], 3 * i);
      kind[i] = Number.isNaN(xyz[3 * i]) ? 0 : moment.alive[i] ? (hasParticles && !hidden[i] ? 1 : 0) : look.removed ? 2 : 0;
      if (kind[i] === 0) xyz.set([0, 0, 0], 3 * i);  // drawn nowhere, but some drivers mind NaN
    }
    this.fill(this.particles, xyz, tint, kind);
    this.particles.material.uniforms.fade.value = marks ? 0.72 : 0;
    this.showSkin(moment, spacing, hasSkin, colour, Boolean(marks));
    this.blade.visible = Boolean(blade);
    if (blade) this.placeBlade(blade, spacing);
    this.showMarks(moment, spacing, marks);
    this.draw();
    return { words, scale };
  }

  // Particles of which all six neighbours are there are behind these.
  enclosed(moment, edges) {
    const found = new Uint8Array(moment.alive.length);
    if (!edges || !this.data.body.onGrid) return found;
    for (let e = 0; e < edges.a.length; ++e) {
      const a = edges.a[e], b = edges.b[e];
      if (moment.alive[a] && moment.alive[b]) ++found[a], ++found[b];
    }
    return found.map((count) => (count === 6 ? 1 : 0));
  }

  fill(points, xyz, tint, kind) {
    View.set(points.geometry, 'position', xyz, 3);
    View.set(points.geometry, 'tint', tint, 3);
    View.set(points.geometry, 'kind', kind, 1);
    points.visible = kind.some((k) => k > 0);
  }

  showSkin(moment, spacing, wanted, colour, isFaded) {
    this.skin.visible = wanted;
    if (!this.skin.visible) return;
    const xyz = places(moment.skin, moment, this.centre, spacing);
    const tint = new Float32Array(xyz.length);
    for (let v = 0; v < moment.owner.length; ++v) tint.set(moment.owner[v] < 0 ? kTissue : colour(moment.owner[v]), 3 * v);
    const geometry = this.skin.geometry;
    View.set(geometry, 'position', xyz, 3);
    View.set(geometry, 'tint', tint, 3);
    View.set(geometry, 'normal', normals(xyz, moment.triangles), 3);
    if (this.triangles !== moment.triangles) geometry.setIndex(new BufferAttribute(new Uint32Array(moment.triangles), 1));
    this.triangles = moment.triangles;
    this.skin.material.uniforms.fade.value = isFaded ? 0.22 : 1;
    this.skin.material.transparent = isFaded;
    this.skin.material.depthWrite = !isFaded;
  }

  placeBlade([edge, along, back], spacing) {
    const x = new Vector3(...along), z = new Vector3(...back);
    const y = new Vector3().crossVectors(z, x);
    const at = edge.map((c, k) => (c - this.centre[k]) / spacing);
    this.blade.matrix.makeBasis(x, y, z).setPosition(at[0], at[1], at[2]);
  }

  showMarks(moment, spacing, marks) {
    const named = marks ? [...new Set([...marks.particles, ...marks.path])] : [];
    const chosen = new Set(named);
    const members = marks ? marks.members.filter((i) => !chosen.has(i)) : [];
    const all = [...members, ...named];
    const xyz = places(moment.x, moment, this.centre, spacing);
    const place = new Float32Array(3 * all.length), tint = new Float32Array(3 * all.length);
    const kind = new Float32Array(all.length);
    all.forEach((i, k) => {
      const isThere = !Number.isNaN(xyz[3 * i]);
      if (isThere) place.set(xyz.subarray(3 * i, 3 * i + 3), 3 * k);
      tint.set(k < members.length ? kMember : kMarked, 3 * k);
      kind[k] = isThere ? (k < members.length ? 3 : 4) : 0;
    });
    this.fill(this.marks, place, tint, kind);
    const path = marks ? marks.path.filter((i) => !Number.isNaN(xyz[3 * i])) : [];
    const line = new Float32Array(3 * path.length);
    path.forEach((i, k) => line.set(xyz.subarray(3 * i, 3 * i + 3), 3 * k));
    View.set(this.path.geometry, 'position', line, 3);
    this.path.visible = path.length > 1;
    this.marked = place.filter((_, k) => kind[Math.floor(k / 3)] > 0);
  }

  // Flies to what is marked, if anything is.
  flyToMarks() {
    if (!this.marked || this.marked.length === 0) return;
    const m = this.data.body.orientation;
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < this.marked.length; i += 3) {
      const [x, y, z] = this.marked.subarray(i, i + 3);
      for (let k = 0; k < 3; ++k) {
        const c = m[3 * k] * x + m[3 * k + 1] * y + m[3 * k + 2] * z;
        if (c < low[k]) low[k] = c;
        if (c > high[k]) high[k] = c;
      }
    }
    const radius = Math.hypot(...low.map((x, k) => high[k] - x)) / 2;
    // Never so near that nobody sees where in the body it is.
    const seen = Math.min(this.radius, Math.max(1.8 * radius + 2, 0.5 * this.radius));
    this.orbit.fly(low.map((x, k) => (x + high[k]) / 2), this.distanceFor(seen));
  }
}
