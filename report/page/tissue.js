// One run in the 3D view: particles, skin, blade, and what a verdict names. Lengths are in h, the middle of the body
// is 0. Places go to the GPU as they lie in the page, and surfaces find their normals there: per moment this writes a
// colour for each particle and nothing else.
import {
  BoxBufferGeometry, BufferAttribute, BufferGeometry, Color, DoubleSide, EdgesGeometry, Group, Line, LineBasicMaterial,
  LineSegments, Matrix4, Mesh, MeshBasicMaterial, Points, PointsMaterial, ShaderMaterial, Vector3,
} from 'three';
import { kNowhere, kStride, places, scaleOf } from './coding.js';
import { kDead, kTissue } from './colours.js';

const kLight = 'vec3 light(vec3 colour, vec3 n) { float lit = 0.42 + 0.58 * max(dot(n, normalize(vec3(0.35, 0.5, 0.8))), 0.0); return colour * lit; }';
const kPlace = 'uniform vec3 low, step3; vec3 placed(vec3 steps) { return low + step3 * steps; }';

// Balls as discs that face the camera. The fourth number of a tint says what a point is: 0 nothing, 1 alive,
// 2 removed, 3 and 4 marked, 5 marked as a ring, so that what lies below is seen through it, 6 alive and marked: it does
// not fade. A mark is a little larger than what it marks, and its rim a few pixels wide, however near it is. `slab`: above 0, only what lies so near behind the cut plane.
const pointShader = (isInFront, plane) => ({
  uniforms: { perPixel: { value: 1 }, size: { value: 0.95 }, fade: { value: 0 }, slab: { value: 0 }, back: { value: new Color() },
    low: { value: new Vector3() }, step3: { value: new Vector3(1, 1, 1) }, plane },
  vertexShader: `${kPlace} attribute vec4 tint; uniform float perPixel, size, slab; uniform vec4 plane; varying vec3 colour; varying float which, rim;
    void main() {
      vec3 here = placed(position);
      float kind = floor(tint.a * 255.0 + 0.5), behind = plane.w - dot(plane.xyz, here);
      bool isCut = (kind < 2.5 || kind > 5.5) && (behind < 0.0 || (slab > 0.0 && behind > slab));
      vec4 place = modelViewMatrix * vec4(here, 1.0);
      gl_Position = kind < 0.5 || isCut || position.x > ${kNowhere - 0.5} ? vec4(2.0, 2.0, 2.0, 1.0) : projectionMatrix * place;
      float ball = size * perPixel / -place.z;
      gl_PointSize = kind < 1.5 || kind > 5.5 ? max(ball, 1.5) : kind < 2.5 ? max(0.55 * ball, 1.5)
        : max(max(1.1 * ball, min((kind > 3.5 ? 1.6 : 1.15) * ball, 24.0)), 9.0);
      colour = tint.rgb; which = kind;
      rim = clamp(5.0 / gl_PointSize, 0.05, 0.2);
    }`,
  fragmentShader: `${kLight} uniform vec3 back; uniform float fade; varying vec3 colour; varying float which, rim;
    void main() {
      vec2 p = 2.0 * gl_PointCoord - 1.0; float r = dot(p, p), inside = 1.0 - sqrt(r);
      bool isMark = which > 2.5 && which < 5.5, isRing = isMark && which > 4.5;
      if (r > 1.0 || (which > 1.5 && which < 2.5 && r < 0.4) || (isRing && inside > rim + max(rim, 0.14))) discard;
      vec3 n = vec3(p.x, -p.y, sqrt(max(1.0 - r, 0.0)));
      vec3 lit = light(colour, n);
      if (isMark) lit = inside < rim ? vec3(0.07) : isRing ? colour : mix(lit, colour, 0.5);
      else if (r > 0.8) lit *= 0.8;
      gl_FragColor = vec4(mix(lit, back, which > 2.5 ? 0.0 : fade), 1.0);
    }`,
  depthTest: !isInFront, transparent: isInFront,
});

// A surface without normals: the GPU derives each triangle's from where its pixels lie.
const surfaceShader = (plane, isFlat = false) => ({
  uniforms: { fade: { value: 1 }, low: { value: new Vector3() }, step3: { value: new Vector3(1, 1, 1) }, plane },
  vertexShader: `${kPlace} attribute vec4 tint; varying vec3 colour, seen, here;
    void main() { colour = tint.rgb; here = placed(position); vec4 place = modelViewMatrix * vec4(here, 1.0); seen = place.xyz; gl_Position = projectionMatrix * place; }`,
  fragmentShader: `${kLight} uniform float fade; uniform vec4 plane; varying vec3 colour, seen, here;
    void main() {
      if (dot(plane.xyz, here) > plane.w) discard;
      vec3 n = normalize(cross(dFdx(seen), dFdy(seen)));
      vec3 lit = ${isFlat ? 'mix(colour, light(colour, n), 0.35)' : 'light(gl_FrontFacing ? colour : colour * 0.6, n)'};
      gl_FragColor = vec4(lit, fade);
    }`,
  side: DoubleSide, transparent: true, extensions: { derivatives: true },
});

const kMarked = [214, 94, 0], kMember = [240, 227, 66];
// Of so many members each is joined with each, of more with their middle.
const kMostPairs = 5;
// How far apart the dots of such a line are [h]; of a long one there are so many at most.
const kDots = 0.025, kMostDots = 400;
// How solid the blade is; and where something is marked, which it must not hide.
const kBlade = 0.36, kBladeBesideMarks = 0.1;
// A neighbour so far away [h] hides nothing.
const kCovers = 1.3;

// Writes a list to the GPU in memory that stays: it grows by half where it is too small, and else is written again.
function write(geometry, name, list, size, isNormal = false) {
  let attribute = name === 'index' ? geometry.index : geometry.attributes[name];
  if (attribute && attribute.written === list) return;
  if (!attribute || attribute.array.length < list.length) {
    if (attribute) geometry.dispose();  // or the old memory would stay with the GPU
    const room = attribute ? Math.ceil((1.5 * list.length) / size) * size : list.length;
    const array = new list.constructor(room);
    attribute = new BufferAttribute(array, size, isNormal);
    if (name === 'index') geometry.setIndex(attribute); else geometry.setAttribute(name, attribute);
  }
  attribute.array.set(list);
  attribute.updateRange.offset = 0;
  attribute.updateRange.count = list.length;
  attribute.needsUpdate = true;
  attribute.written = list;
}

// Which way triangles face, away from the middle of the body: they may be wound the wrong way round. Null where they do
// not agree, or there are none.
function facingOf(corners) {
  const sum = [0, 0, 0];
  let all = 0;
  for (let k = 0; k < corners.length; k += 9) {
    const [p, q] = [3, 6].map((to) => [0, 1, 2].map((c) => corners[k + to + c] - corners[k + c]));
    const n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
    const isOut = n.reduce((s, x, c) => s + x * (corners[k + c] + corners[k + 3 + c] + corners[k + 6 + c]), 0) >= 0;
    n.forEach((x, c) => { sum[c] += isOut ? x : -x; });
    all += Math.hypot(...n);
  }
  const size = Math.hypot(...sum);
  return size > 0.5 * all ? sum.map((x) => x / size) : null;
}

// Patches of four corners each [m], and their rims, where neighbours do not share them.
function putPatches(faces, rims, patches, centre, spacing) {
  const corners = Float32Array.from(patches, (x, k) => (x - centre[k % 3]) / spacing);
  const surface = [], lines = [];
  for (let first = 0; first < corners.length / 3; first += 4) {
    for (const c of [0, 1, 2, 0, 2, 3]) surface.push(first + c);
    for (const c of [0, 1, 1, 2, 2, 3, 3, 0]) lines.push(first + c);
  }
  for (const [made, index] of [[faces, surface], [rims, lines]]) {
    write(made.geometry, 'position', corners, 3);
    write(made.geometry, 'index', new Uint32Array(index), 1);
    made.geometry.setDrawRange(0, index.length);
  }
}

export class Tissue {
  // moments: of this run.
  constructor(data, moments, plane) {
    this.data = data;
    this.moments = moments;
    this.facing = null;  // of the triangles that are marked
    this.body = new Group();
    const m = data.body.orientation;
    this.body.matrixAutoUpdate = false;
    this.body.matrix = new Matrix4().set(m[0], m[1], m[2], 0, m[3], m[4], m[5], 0, m[6], m[7], m[8], 0, 0, 0, 0, 1);
    const add = (made, order = 0) => {
      made.frustumCulled = false;
      made.renderOrder = order;
      this.body.add(made);
      return made;
    };
    this.skin = add(new Mesh(new BufferGeometry(), new ShaderMaterial(surfaceShader(plane))));
    this.particles = add(new Points(new BufferGeometry(), new ShaderMaterial(pointShader(false, plane))));
    this.blade = new Group();
    this.body.add(this.blade);
    const nowhere = { value: plane.value.clone().set(0, 0, 0, 1e9) };  // what is marked is never cut away
    this.triangles = add(new Mesh(new BufferGeometry(), new ShaderMaterial({ ...surfaceShader(nowhere, true), depthTest: false })), 2);
    this.rims = add(new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x111111, depthTest: false })), 2.5);
    this.path = add(new Line(new BufferGeometry(), new LineBasicMaterial({ color: 0xd55e00, depthTest: false })), 3);
    // Black on white, which is seen on any colour; of dots, because WebGL draws lines one pixel wide only.
    const joined = new BufferGeometry();
    this.lines = [[5.5, 0xffffff], [2.5, 0x111111]].map(([size, color], k) => add(new Points(joined, new PointsMaterial({ size, color, sizeAttenuation: false, depthTest: false, transparent: true })), 5 + k));
    this.marks = add(new Points(new BufferGeometry(), new ShaderMaterial(pointShader(true, nowhere))), 4);
    if (data.blade) this.makeBlade();
    if (data.foreign) this.makeSwept(add);
  }

  // The whole way of the blade's edge, of each moment of somebody else's run what it has swept: four corners each [m].
  // The latter from the body's middle in its moment: a body that falls takes along where it has been cut.
  way() {
    if (this.data.foreign) return this.moments.flatMap(({ swept, middle }) => swept.map((x, k) => x - (middle ? middle[k % 3] : 0)));
    const corners = [], half = this.data.blade ? this.data.blade.size[0] / 2 : 0;
    const end = (places, k, side) => [0, 1, 2].map((c) => places[6 * k + c] + side * half * places[6 * k + 3 + c]);
    for (const places of this.data.blade ? this.data.blade.way : []) {
      for (let k = 0; k + 1 < places.length / 6; ++k) corners.push(...end(places, k, -1), ...end(places, k, 1), ...end(places, k + 1, 1), ...end(places, k + 1, -1));
    }
    return corners;
  }

  hasWay() { return this.way().length > 0; }

  // Pale, with its outline: where the blade is, and what it does there, must be seen before it.
  makeWay(centre, spacing) {
    const patches = new Mesh(new BufferGeometry(), new MeshBasicMaterial({ color: 0x7d93a8, transparent: true, opacity: 0.13, side: DoubleSide, depthWrite: false }));
    const rims = new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x7d93a8, transparent: true, opacity: 0.75 }));
    putPatches(patches, rims, this.way(), this.data.foreign ? [0, 0, 0] : centre, spacing);
    for (const made of [patches, rims]) [made.frustumCulled, made.renderOrder] = [false, 0.5];
    this.ofWay = new Group();
    this.ofWay.add(patches, rims);
    this.body.add(this.ofWay);
  }

  makeBlade() {
    const h = this.data.body.spacing;
    const [length, depth, thickness] = this.data.blade.size.map((x) => x / h);
    const box = new BoxBufferGeometry(length, Math.max(thickness, 0.05), depth);
    box.translate(0, 0, depth / 2);
    const steel = new ShaderMaterial(surfaceShader({ value: { x: 0, y: 0, z: 0, w: 1e9 } }));
    steel.uniforms.fade.value = kBlade;
    steel.depthWrite = false;
    const tint = new Uint8Array(box.attributes.position.count * 4);
    for (let i = 0; i < tint.length; i += 4) tint.set([184, 204, 224, 255], i);
    box.setAttribute('tint', new BufferAttribute(tint, 4, true));
    this.steel = steel;
    const plate = new Mesh(box, steel);
    plate.renderOrder = 1;
    this.blade.add(plate, new LineSegments(new EdgesGeometry(box), new LineBasicMaterial({ color: 0x5a6b7b })));
    this.blade.matrixAutoUpdate = false;
  }

  // What the blade has swept, as patches with rims.
  makeSwept(add) {
    this.swept = add(new Mesh(new BufferGeometry(), new ShaderMaterial(surfaceShader({ value: { x: 0, y: 0, z: 0, w: 1e9 } }, true))), 1);
    this.swept.material.depthWrite = this.swept.material.depthTest = false;
    this.sweptRims = add(new LineSegments(new BufferGeometry(), new LineBasicMaterial({ color: 0x5a6b7b, depthTest: false })), 1.5);
  }

  // patches: of each four corners, three numbers each [m]. Returns the legend.
  showSwept(patches, isFaded, centre, spacing) {
    const tint = new Uint8Array((4 * patches.length) / 3);
    for (let i = 0; i < tint.length; i += 4) tint.set([184, 204, 224, 255], i);
    write(this.swept.geometry, 'tint', tint, 4, true);
    putPatches(this.swept, this.sweptRims, patches, centre, spacing);
    this.swept.material.uniforms.fade.value = isFaded ? kBladeBesideMarks : kBlade;
    this.swept.visible = this.sweptRims.visible = patches.length > 0;
    return patches.length ? 'Steel: what the blade has swept on the way to this frame.' : '';
  }

  static scale(material, moment, centre, spacing) {
    const { low, step } = scaleOf(moment, centre, spacing);
    material.uniforms.low.value.set(...low);
    material.uniforms.step3.value.set(...step);
  }

  // moment: its arrays; about: of the moment what the page says of it; look: {skin, particles, removed, colouring,
  // isCut}; marks: of a finding, or null. Returns the legend.
  show(moment, about, look, marks, { centre, start, edges, first }) {
    const spacing = this.data.body.spacing || 1;
    const n = moment.x.length / kStride;
    const hasSkin = look.skin && moment.triangles.length > 0;
    // A moment without a skin, as the start is, shows particles rather than nothing.
    const hasParticles = look.particles || !hasSkin;
    let xyz = null;
    const placesOfIt = () => xyz || (xyz = places(moment.x, moment, centre, spacing));
    this.shown = { alive: moment.alive, places: placesOfIt };
    const { colour, shows, words, scale, keys } = look.colouring.of({ moment, first, places: placesOfIt, start, edges, stage: about.stage, isStart: about.start, apart: about.apart });
    const hidden = hasParticles && !look.isCut ? this.covered(moment, edges, placesOfIt) : null;
    // Written over in each moment: a browser that makes and drops megabytes so often stops to tidy up.
    if (!this.tint || this.tint.length < n) [this.tint, this.seen] = [new Uint32Array(n), new Uint32Array(n)];
    const { tint, seen } = this;
    let drawn = 0;
    for (let i = 0; i < n; ++i) {
      const isAlive = moment.alive[i] !== 0;
      let kind = isAlive ? ((hasParticles && !(hidden && hidden[i] === 1)) || look.isCut ? 1 : 0) : look.removed ? 2 : 0;
      if (shows && shows(i)) kind = shows(i);
      if (kind > 0) seen[drawn++] = i;
      const c = isAlive || kind === 2 && shows ? colour(i) : kDead;
      tint[i] = ((kind << 24) | c) >>> 0;
    }
    // Where colours say something, marks leave them to be seen.
    const isRing = Boolean(marks) && hasParticles && !look.colouring.mayBeCovered;
    if (isRing) {
      for (const i of new Set([...marks.particles, ...marks.path, ...marks.members])) {
        if (!moment.alive[i]) continue;
        if (tint[i] >>> 24 === 0) seen[drawn++] = i;
        tint[i] = ((6 << 24) | colour(i)) >>> 0;
      }
    }
    this.particles.visible = drawn > 0;
    if (drawn > 0) {
      // Only those that are seen go through the GPU, which may be the processor: of a large body these are few.
      write(this.particles.geometry, 'position', moment.x, kStride);
      write(this.particles.geometry, 'tint', new Uint8Array(tint.buffer, 0, 4 * n), 4, true);
      write(this.particles.geometry, 'index', seen.subarray(0, drawn), 1);
      this.particles.geometry.setDrawRange(0, drawn);
      Tissue.scale(this.particles.material, moment, centre, spacing);
    }
    this.particles.material.uniforms.fade.value = marks ? 0.72 : 0;
    // The face of a cut is closed by what lies behind it.
    this.particles.material.uniforms.slab.value = look.isCut && !hasParticles ? 2 : 0;
    this.showSkin(moment, hasSkin, tint, colour, Boolean(marks), centre, spacing);
    this.blade.visible = Boolean(about.blade);
    if (about.blade) {
      this.placeBlade(about.blade, centre, spacing);
      // Through discs, which have no depth, it would cut crescents.
      this.steel.uniforms.fade.value = marks ? kBladeBesideMarks : kBlade;
      this.steel.depthTest = !marks && !hasParticles;
    }
    if (!this.ofWay) this.makeWay(centre, spacing);
    this.ofWay.visible = look.way;
    if (this.data.foreign && about.middle) this.ofWay.position.set(...about.middle.map((x, k) => (x - centre[k]) / spacing));
    const isWaySeen = look.way && this.hasWay();
    const steel = this.swept ? this.showSwept(about.swept, Boolean(marks), centre, spacing) : about.blade ? 'Steel: the blade.' : '';
    const blade = [steel, isWaySeen && 'Pale: the way of its edge.'].filter(Boolean).join(' ');
    this.showMarks(moment, marks, isRing, placesOfIt, centre, spacing);
    return { words, scale, keys, blade };
  }

  // Which particles nobody can see, wherever they look from: all six neighbours are there and near, and theirs as well,
  // because one layer of discs has gaps.
  covered(moment, edges, placesOfIt) {
    if (!edges || !this.data.body.onGrid) return null;
    if (this.coveredX === moment.x && this.coveredAlive === moment.alive) return this.coveredOnes;
    const { alive } = moment, { a, b } = edges, xyz = placesOfIt();
    const near = new Uint8Array(alive.length), inner = new Uint8Array(alive.length);
    const isNear = new Uint8Array(a.length);
    for (let e = 0; e < a.length; ++e) {
      const i = a[e], j = b[e];
      if (!alive[i] || !alive[j]) continue;
      const x = xyz[3 * i] - xyz[3 * j], y = xyz[3 * i + 1] - xyz[3 * j + 1], z = xyz[3 * i + 2] - xyz[3 * j + 2];
      if (x * x + y * y + z * z > kCovers * kCovers) continue;
      isNear[e] = 1;
      ++near[i];
      ++near[j];
    }
    for (let e = 0; e < a.length; ++e) {
      if (!isNear[e]) continue;
      if (near[b[e]] === 6) ++inner[a[e]];
      if (near[a[e]] === 6) ++inner[b[e]];
    }
    for (let i = 0; i < inner.length; ++i) inner[i] = near[i] === 6 && inner[i] === 6 ? 1 : 0;
    [this.coveredX, this.coveredAlive, this.coveredOnes] = [moment.x, moment.alive, inner];
    return inner;
  }

  showSkin(moment, wanted, tint, colour, isFaded, centre, spacing) {
    this.skin.visible = wanted;
    if (!wanted) return;
    const count = moment.owner.length;
    const ofVertex = new Uint32Array(count);
    for (let v = 0; v < count; ++v) {
      const owner = moment.owner[v];
      ofVertex[v] = owner < 0 ? kTissue : moment.alive[owner] ? tint[owner] : colour(owner);
    }
    const geometry = this.skin.geometry;
    write(geometry, 'position', moment.skin, kStride);
    write(geometry, 'tint', new Uint8Array(ofVertex.buffer), 4, true);
    if (moment.triangles !== this.shownTriangles) write(geometry, 'index', new Uint32Array(moment.triangles), 1);
    this.shownTriangles = moment.triangles;
    geometry.setDrawRange(0, moment.triangles.length);
    Tissue.scale(this.skin.material, moment, centre, spacing);
    this.skin.material.uniforms.fade.value = isFaded ? 0.22 : 1;
    this.skin.material.transparent = isFaded;
    this.skin.material.depthWrite = !isFaded;
  }

  placeBlade([edge, along, back], centre, spacing) {
    const x = new Vector3(...along), z = new Vector3(...back);
    const y = new Vector3().crossVectors(z, x);
    const at = edge.map((c, k) => (c - centre[k]) / spacing);
    this.blade.matrix.makeBasis(x, y, z).setPosition(at[0], at[1], at[2]);
  }

  showMarks(moment, marks, isRing, placesOfIt, centre, spacing) {
    const neighbours = marks ? marks.neighbours || [] : [];
    const named = marks ? [...new Set([...marks.particles, ...marks.path])] : [];
    const chosen = new Set(named);
    const members = marks ? marks.members.filter((i) => !chosen.has(i)) : [];
    const isYellow = new Set([...members, ...neighbours]);
    const all = [...members, ...named];
    const xyz = all.length ? placesOfIt() : new Float32Array(0);
    const isThere = (i) => !Number.isNaN(xyz[3 * i]);
    // Balls would hide the triangles at whose corners they sit.
    const kNamed = isRing || (marks && (marks.corners || []).length) ? 5 : 4, kOther = isRing ? 5 : 3;
    const place = new Float32Array(3 * all.length), tint = new Uint8Array(4 * all.length);
    all.forEach((i, k) => {
      if (isThere(i)) place.set(xyz.subarray(3 * i, 3 * i + 3), 3 * k);
      tint.set([...(isYellow.has(i) ? kMember : kMarked), isThere(i) ? (k < members.length ? kOther : kNamed) : 0], 4 * k);
    });
    write(this.marks.geometry, 'position', place, 3);
    write(this.marks.geometry, 'tint', tint, 4, true);
    this.marks.geometry.setDrawRange(0, all.length);
    this.marks.visible = all.length > 0;
    const path = marks ? marks.path.filter(isThere) : [];
    const line = new Float32Array(3 * path.length);
    path.forEach((i, k) => line.set(xyz.subarray(3 * i, 3 * i + 3), 3 * k));
    write(this.path.geometry, 'position', line, 3);
    this.path.geometry.setDrawRange(0, path.length);
    this.path.visible = path.length > 1;
    this.showJoined(marks ? marks.joined || [] : [], xyz, isThere);
    const corners = this.showTriangles(moment, marks ? marks.corners || [] : [], centre, spacing);
    this.marked = [...corners, ...place.filter((_, k) => tint[4 * Math.floor(k / 3) + 3] > 0)];
  }

  // Lines between the members of a cluster, because balls alone do not say which of them hold together.
  showJoined(joined, xyz, isThere) {
    const found = [];
    const at = (i) => xyz.subarray(3 * i, 3 * i + 3);
    const line = (from, to) => {
      const n = Math.min(Math.ceil(Math.hypot(...[0, 1, 2].map((k) => to[k] - from[k])) / kDots), kMostDots);
      for (let s = 0; s <= n; ++s) for (let k = 0; k < 3; ++k) found.push(from[k] + (n ? s / n : 0) * (to[k] - from[k]));
    };
    for (const { members } of joined) {
      const there = members.filter(isThere);
      const middle = [0, 1, 2].map((k) => there.reduce((sum, i) => sum + xyz[3 * i + k], 0) / there.length);
      there.forEach((i, n) => {
        if (there.length > kMostPairs) line(at(i), middle);
        else for (const j of there.slice(n + 1)) line(at(i), at(j));
      });
    }
    const [{ geometry }] = this.lines;
    write(geometry, 'position', new Float32Array(found), 3);
    geometry.setDrawRange(0, found.length / 3);
    for (const one of this.lines) one.visible = found.length > 0;
  }

  // The corners of marked triangles that are somewhere.
  showTriangles(moment, corners, centre, spacing) {
    const skin = corners.length ? places(moment.skin, moment, centre, spacing) : null;
    const found = [];
    for (let k = 0; k + 2 < corners.length; k += 3) {
      const three = corners.slice(k, k + 3);
      if (three.every((v) => 3 * v < skin.length && !Number.isNaN(skin[3 * v]))) for (const v of three) found.push(...skin.subarray(3 * v, 3 * v + 3));
    }
    this.facing = facingOf(found);
    const tint = new Uint8Array((4 * found.length) / 3);
    for (let i = 0; i < tint.length; i += 4) tint.set([...kMarked, 255], i);
    write(this.triangles.geometry, 'position', new Float32Array(found), 3);
    write(this.triangles.geometry, 'tint', tint, 4, true);
    this.triangles.geometry.setDrawRange(0, found.length / 3);
    this.triangles.visible = found.length > 0;
    const rims = [];
    for (let k = 0; k < found.length; k += 9) for (const c of [0, 1, 1, 2, 2, 0]) rims.push(...found.slice(k + 3 * c, k + 3 * c + 3));
    write(this.rims.geometry, 'position', new Float32Array(rims), 3);
    this.rims.geometry.setDrawRange(0, rims.length / 3);
    this.rims.visible = found.length > 0;
    return found;
  }

  points() { return [this.particles, this.marks]; }
}
