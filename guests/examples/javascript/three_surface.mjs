// node three_surface.mjs [exchanged]: surfaces by the marching cubes of three.js. Reads lines of JSON, {"nodes": [x, y, z]
// of a grid, "tissue": numbers of nodes, of which the last axis counts fastest}, and answers each with {"vertices": in
// spacings, "triangles"}. The field is 1 in tissue and 0 elsewhere; exchanged, 0 in tissue and 1 elsewhere.
import { MarchingCubes } from 'three/examples/jsm/objects/MarchingCubes.js'
import { MeshBasicMaterial } from 'three'
import { createInterface } from 'node:readline'

const exchanged = process.argv[2] === 'exchanged'
for await (const line of createInterface({ input: process.stdin })) {
  const { nodes, tissue } = JSON.parse(line)
  const size = Math.max(...nodes) + 3 // it leaves out the outer layer of cells, and looks one node beyond
  const cubes = new MarchingCubes(size, new MeshBasicMaterial(), false, false, 5 * 8 * Math.max(tissue.length, 1))
  cubes.isolation = 0.5
  if (exchanged) cubes.field.fill(1)
  for (const k of tissue) {
    const x = Math.floor(k / (nodes[1] * nodes[2])), y = Math.floor(k / nodes[2]) % nodes[1], z = k % nodes[2]
    cubes.setCell(1 + x, 1 + y, 1 + z, exchanged ? 0 : 1)
  }
  cubes.update()
  // Three vertices for each triangle, in a cube from -1 to 1. Equal ones are the same half of a spacing.
  const vertices = [], numbers = new Map(), corners = []
  for (let k = 0; k < cubes.count; ++k) {
    const place = [0, 1, 2].map(axis => Math.round((cubes.positionArray[3 * k + axis] + 1) * size) / 2 - 1)
    const key = place.join()
    if (!numbers.has(key)) numbers.set(key, vertices.push(place) - 1)
    corners.push(numbers.get(key))
  }
  const triangles = Array.from({ length: corners.length / 3 }, (_, k) => corners.slice(3 * k, 3 * k + 3))
  if (exchanged) triangles.forEach(triangle => triangle.reverse())
  console.log(JSON.stringify({ vertices, triangles }))
}
