// A camera that goes round a place, by mouse, touch and keys. Up is z.
export class Orbit {
  constructor(element, camera, changed) {
    this.camera = camera;
    this.changed = changed;
    this.home = { target: [0, 0, 0], distance: 10, around: -1.05, above: 0.42 };
    this.at = { ...this.home, target: [0, 0, 0] };
    this.middle = [0, 0, 0];  // of what is looked at
    const pointers = new Map();
    let apart = 0;
    element.addEventListener('pointerdown', (event) => {
      element.setPointerCapture(event.pointerId);
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      apart = 0;
      this.flight = null;
    });
    const leave = (event) => pointers.delete(event.pointerId);
    element.addEventListener('pointerup', leave);
    element.addEventListener('pointercancel', leave);
    element.addEventListener('pointermove', (event) => {
      const last = pointers.get(event.pointerId);
      if (!last) return;
      pointers.set(event.pointerId, [event.clientX, event.clientY]);
      const dx = event.clientX - last[0], dy = event.clientY - last[1];
      if (pointers.size === 2) {
        const [a, b] = [...pointers.values()];
        const now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (apart > 0 && now > 0) this.at.distance *= apart / now;
        apart = now;
        this.pan(dx / 2, dy / 2, element.clientHeight);
      } else if (event.altKey && this.onAltDrag) {
        this.onAltDrag(dx, dy, event.shiftKey);
      } else if (event.shiftKey || event.buttons & 6) {
        this.pan(dx, dy, element.clientHeight);
      } else {
        this.turn(-dx * 0.008, dy * 0.008);
      }
    });
    element.addEventListener('contextmenu', (event) => event.preventDefault());
    element.addEventListener('wheel', (event) => {
      // Only where somebody has turned to the view: a page is scrolled by the wheel as well.
      if (document.activeElement !== element) return;
      event.preventDefault();
      this.zoom(Math.exp(event.deltaY * 0.001));
    }, { passive: false });
    element.addEventListener('keydown', (event) => {
      const by = 0.12;
      const height = element.clientHeight;
      const turns = { ArrowLeft: [-by, 0], ArrowRight: [by, 0], ArrowUp: [0, by], ArrowDown: [0, -by] };
      if (event.ctrlKey || event.altKey || event.metaKey) return;
      if (turns[event.key]) {
        const [x, y] = turns[event.key];
        if (event.shiftKey) this.pan(-x * 300, y * 300, height); else this.turn(x, y);
      } else if (event.key === '+' || event.key === '=') this.zoom(0.87);
      else if (event.key === '-') this.zoom(1.15);
      else if (event.key === '0' || event.key === 'Home') this.goHome();
      else return;
      event.preventDefault();
    });
  }

  turn(around, above) {
    this.at.around += around;
    this.at.above = Math.min(Math.max(this.at.above + above, -1.55), 1.55);
    this.place();
  }

  zoom(by) {
    this.at.distance *= by;
    this.place();
  }

  pan(dx, dy, height) {
    const { around, above, distance, target } = this.at;
    const size = (2 * distance * Math.tan((this.camera.fov * Math.PI) / 360)) / height;
    const right = [-Math.sin(around), Math.cos(around), 0];
    const up = [-Math.sin(above) * Math.cos(around), -Math.sin(above) * Math.sin(around), Math.cos(above)];
    for (let k = 0; k < 3; ++k) target[k] += size * (-dx * right[k] + dy * up[k]);
    this.place();
  }

  // Goes along with a body whose middle is there now.
  follow(middle) {
    for (const one of [this.at, this.home]) one.target = one.target.map((x, k) => x + middle[k] - this.middle[k]);
    this.flight = null;
    this.middle = middle;
    this.place();
  }

  goHome() {
    if (this.beforeHome) this.beforeHome();
    this.fly(this.home.target, this.home.distance, this.home);
  }

  fly(target, distance, angles) {
    const from = { ...this.at, target: [...this.at.target] };
    const to = { around: this.at.around, above: this.at.above, ...angles, target: [...target], distance };
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) {
      this.at = to;
      this.place();
      return;
    }
    const begin = performance.now();
    const flight = {};
    this.flight = flight;
    const go = (now) => {
      if (this.flight !== flight) return;
      const t = Math.min((now - begin) / 500, 1);
      const s = t * t * (3 - 2 * t);
      const mix = (a, b) => a + s * (b - a);
      this.at = { target: from.target.map((x, k) => mix(x, to.target[k])), distance: from.distance * (to.distance / from.distance) ** s,
        around: mix(from.around, to.around), above: mix(from.above, to.above) };
      this.place();
      if (t < 1) requestAnimationFrame(go);
    };
    requestAnimationFrame(go);
  }

  place() {
    const { target, distance, around, above } = this.at;
    this.camera.position.set(target[0] + distance * Math.cos(above) * Math.cos(around),
      target[1] + distance * Math.cos(above) * Math.sin(around), target[2] + distance * Math.sin(above));
    this.camera.near = distance / 100;
    this.camera.far = distance * 20;
    this.camera.lookAt(target[0], target[1], target[2]);
    this.camera.updateProjectionMatrix();
    this.changed();
  }
}
