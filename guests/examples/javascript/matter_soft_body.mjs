// node matter_soft_body.mjs [KICK]: a soft body of matter-js, cut in two. Prints a run, as cannon_cloth.mjs does; a pixel is
// a millimetre. KICK: what is added to the velocity of particle 0 after the cut [m/s].
import Matter from 'matter-js'

const kick = Number(process.argv[2] ?? 0), dt = 1 / 60, cut = 61.5
const engine = Matter.Engine.create({ gravity: { x: 0, y: 0 } })
const alone = { collisionFilter: { mask: 0 }, frictionAir: 0 }
const body = Matter.Composites.softBody(-5, -5, 14, 6, 0, 0, true, 5, alone, { stiffness: 0.2 })
Matter.Composite.add(engine.world, body)
const particles = body.bodies, number = new Map(particles.map((particle, k) => [particle, k]))
particles.forEach(particle => Matter.Body.setVelocity(particle, { // it is being pulled apart, and waves
  x: (particle.position.x - cut) / 100, y: Math.sin(particle.position.x / 20) / 5
}))
const springs = () => Matter.Composite.allConstraints(engine.world).map(({ bodyA, bodyB }) => [number.get(bodyA), number.get(bodyB)])
const inMetres = ({ x, y }) => [x / 1000, y / 1000, 0]

console.log(JSON.stringify({
  rest: particles.map(({ position }) => inMetres(position)), mass: particles.map(({ mass }) => mass), edges: springs(),
  promises: 'free'
}))
for (let frame = 0; frame < 40; ++frame) {
  if (frame > 0) Matter.Engine.update(engine, 1000 * dt)
  let blade = null
  if (frame === 10) {
    const x = cut / 1000
    blade = [[[x, -1, -1], [x, 1, -1], [x, 1, 1], [x, -1, 1]]]
    const isCut = ({ bodyA, bodyB }) => (bodyA.position.x < cut) !== (bodyB.position.x < cut)
    Matter.Composite.remove(body, body.constraints.filter(isCut))
  }
  if (frame === 15) {
    const { x, y } = Matter.Body.getVelocity(particles[0])
    Matter.Body.setVelocity(particles[0], { x, y: y + 1000 * dt * kick })
  }
  console.log(JSON.stringify({
    positions: particles.map(({ position }) => inMetres(position)), time: frame * dt, groups: springs(), blade,
    velocities: particles.map(particle => inMetres(Matter.Body.getVelocity(particle)).map(each => each / dt))
  }))
}
