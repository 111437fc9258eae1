// node mujoco_sheet.mjs [SOLVER] [KICK]: two flexible sheets of MuJoCo that constraints join, and a cut of these. Prints
// a run, as cannon_cloth.mjs does. SOLVER: Newton (default), CG or PGS. KICK: what is added to the velocity of vertex 0
// after the cut [m/s].
import loadMujoco from 'mujoco-js'

const [solver = 'Newton', kick = 0] = process.argv.slice(2)
const columns = 5, rows = 6, h = 0.1, dt = 0.005, cut = 4.5 * h
const sheet = (name, first) => `<flexcomp name="${name}" type="grid" dim="2" count="${columns} ${rows} 1"
    spacing="${h} ${h} ${h}" pos="${(first + (columns - 1) / 2) * h} ${(rows - 1) / 2 * h} 0" mass="0.3" radius="0.001">
  <contact internal="false" selfcollide="none" contype="0" conaffinity="0"/><edge equality="true"/></flexcomp>`
const joints = Array.from({ length: rows }, (_, j) => [(columns - 1) * rows + j, columns * rows + j])
const xml = `<mujoco><option timestep="${dt}" solver="${solver}"/>
  <worldbody>${sheet('left', 0)}${sheet('right', columns)}</worldbody>
  <equality>${joints.map(([a, b]) => `<connect body1="left_${a}" body2="right_${b - columns * rows}" anchor="0 0 0"/>`).join('')}
  </equality></mujoco>`

const mujoco = await loadMujoco()
mujoco.FS.writeFile('/sheet.xml', xml)
const model = mujoco.MjModel.loadFromXML('/sheet.xml'), data = new mujoco.MjData(model)
mujoco.mj_forward(model, data)
const bodies = Array.from(model.flex_vertbodyid), at = bodies.map(body => model.body_dofadr[body])
const threes = (numbers, begins) => begins.map(k => Array.from(numbers.slice(k, k + 3)))
const positions = () => threes(data.flexvert_xpos, bodies.map((_, i) => 3 * i))
const edges = []
for (let sheet = 0; sheet < 2; ++sheet) {
  const begin = model.flex_edgeadr[sheet], first = model.flex_vertadr[sheet]
  for (let k = begin; k < begin + model.flex_edgenum[sheet]; ++k) {
    edges.push([first + model.flex_edge[2 * k], first + model.flex_edge[2 * k + 1]])
  }
}
const rest = positions()
rest.forEach(([x, y], i) => { // it is being pulled apart, and waves
  data.qvel[at[i]] = x - cut
  data.qvel[at[i] + 2] = 0.5 * Math.sin(5 * y)
})

console.log(JSON.stringify({
  rest, mass: bodies.map(body => model.body_mass[body]), edges: [...edges, ...joints], gravity: [0, 0, -9.81], promises: 'free'
}))
for (let frame = 0; frame < 40; ++frame) {
  if (frame > 0) mujoco.mj_step(model, data)
  mujoco.mj_kinematics(model, data) // a step leaves places that are those of its start
  mujoco.mj_flex(model, data)
  let blade = null
  if (frame === 10) {
    const z = data.flexvert_xpos[2]
    blade = [[[cut, -1, z - 1], [cut, 2, z - 1], [cut, 2, z + 1], [cut, -1, z + 1]]]
    for (let k = 0; k < rows; ++k) data.eq_active[k] = 0 // the sheets' own come after those that join them
  }
  if (frame === 15) data.qvel[at[0] + 2] += Number(kick)
  console.log(JSON.stringify({
    positions: positions(), velocities: threes(data.qvel, at), time: frame * dt, blade,
    groups: frame < 10 ? [...edges, ...joints] : edges
  }))
}
