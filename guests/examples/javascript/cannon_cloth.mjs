// node cannon_cloth.mjs [SOLVER] [CUT] [KICK]: a cloth of cannon-es, cut in two while it falls. Prints a run: a line of
// JSON with what is given once, then one for each frame, by the names of docs/reference/run.md.
// SOLVER: gs (default), or split, which solves each island by itself. CUT: constraints (default), or bodies, which
// removes particles beside the blade and trusts that their constraints go with them. KICK: what is added to the velocity
// of particle 0 after the cut [m/s].
import * as CANNON from 'cannon-es'

const [solver = 'gs', cutting = 'constraints', kick = 0] = process.argv.slice(2)
const columns = 14, rows = 10, h = 0.1, dt = 1 / 60, cut = 6.5 * h

const world = new CANNON.World({ gravity: new CANNON.Vec3(0, 0, -9.81) })
if (solver === 'split') world.solver = new CANNON.SplitSolver(world.solver)
world.solver.iterations = 100 // so many that its tolerance ends them
const bodies = []
for (let i = 0; i < columns; ++i) {
  for (let j = 0; j < rows; ++j) {
    const body = new CANNON.Body({ mass: 0.01, shape: new CANNON.Particle(), collisionFilterMask: 0, linearDamping: 0 })
    body.position.set(i * h, j * h, 0)
    body.velocity.set(i * h - cut, 0, 0.5 * Math.sin(j)) // it is being pulled apart, and waves
    world.addBody(body)
    bodies.push(body)
  }
}
const edges = bodies.flatMap((_, k) => [
  ...(k + rows < bodies.length ? [[k, k + rows]] : []), ...((k + 1) % rows > 0 ? [[k, k + 1]] : [])])
let threads = edges.map(([a, b]) => ({ a, b, constraint: new CANNON.DistanceConstraint(bodies[a], bodies[b]) }))
threads.forEach(({ constraint }) => world.addConstraint(constraint))

console.log(JSON.stringify({
  rest: bodies.map(body => body.position.toArray()), mass: bodies.map(body => body.mass), edges, promises: 'free',
  gravity: world.gravity.toArray()
}))
const removed = bodies.map(() => 0)
for (let frame = 0; frame < 40; ++frame) {
  if (frame > 0) world.step(dt)
  let blade = null
  if (frame === 10) {
    const z = bodies[0].position.z
    blade = [[[cut, -1, z - 1], [cut, 2, z - 1], [cut, 2, z + 1], [cut, -1, z + 1]]]
    const isCut = ({ a, b }) => (bodies[a].position.x < cut) !== (bodies[b].position.x < cut)
    if (cutting === 'bodies') {
      threads.filter(isCut).forEach(({ a }) => { removed[a] = 1; world.removeBody(bodies[a]) })
    } else {
      threads.filter(isCut).forEach(({ constraint }) => world.removeConstraint(constraint))
    }
    threads = threads.filter(({ constraint }) => world.constraints.includes(constraint))
  }
  if (frame === 15) bodies[0].velocity.z += Number(kick)
  console.log(JSON.stringify({
    positions: bodies.map(body => body.position.toArray()), velocities: bodies.map(body => body.velocity.toArray()),
    time: frame * dt, groups: threads.map(({ a, b }) => [a, b]), removed, blade
  }))
}
