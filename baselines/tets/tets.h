// Tetrahedra with position-based dynamics, after Pan et al.: a distance constraint on each edge, a volume constraint on
// each tetrahedron, and cells that a blade splits. Extended position-based dynamics (XPBD; Macklin, Müller and
// Chentanez 2016) with small steps (Macklin et al. 2019): a frame has `steps` substeps of `iterations` sweeps each.
//
// Lengths are in m, times in s, masses in kg, moduli in Pa. docs/baselines/tets.md derives what is not published.
#pragma once
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "baselines/dissection.h"
#include "baselines/tets/tets_mesh.h"

namespace cutproof::baselines {

// The parameters of this method with their defaults. Throws std::invalid_argument with a sentence that names what is
// wrong: unknown names, values out of range.
//   youngs_modulus  0: 2e7 spacing², so that a scene of any spacing bends alike
//   poisson_ratio   from 0 to below 0.5. Distances alone have 1/4: for less, the material has 1/4 and the same modulus
//   density         0: the scene's total mass over the volume of its tetrahedra
//   steps           substeps in a frame
//   iterations      sweeps over all constraints in a substep
//   damping         1/s: velocities decay by this rate
Parameters tets_parameters(const char* text);

// Throws std::invalid_argument where the scene or the parameters are wrong.
std::unique_ptr<Simulator> make_tets_cpu(const Scene& scene, const Parameters& parameters);
std::unique_ptr<Simulator> make_tets_host(const Scene& scene, const Parameters& parameters);
#ifdef BASELINES_HAVE_CUDA
std::unique_ptr<Simulator> make_tets_cuda(const Scene& scene, const Parameters& parameters);
#endif

namespace tets {

// Stiffness of the constraints. A tetrahedron of volume V gives each of its six edges of length l the energy
// distance V / l² (|x| - l)² / 2, and itself volume / V (V' - V)² / 2.
struct Stiffness {
  double distance = 0, volume = 0;  // Pa
};
// Such that bulk modulus and shear modulus, as means over all directions (Voigt), are those of the material. Six
// directions n of equal share S / 6 have the elastic tensor (S / 6) sum n n n n, of bulk modulus S / 9 and mean shear
// modulus S / 15. So S = 15 G, and the volume adds K - 5 G / 3, which is none at a ratio of 1/4 and for less.
Stiffness stiffness_of(double youngs_modulus, double poisson_ratio);

// The order in which a substep visits constraints: by colours, so that those of a colour have no vertex in common and
// may move at once. Colours are greedy, so those of a component depend on that component alone.
struct Sweep {
  std::vector<std::array<int32_t, 2>> edges;
  std::vector<std::array<int32_t, 4>> cells;
  std::vector<std::size_t> edge_starts, cell_starts;  // [colours + 1]
};
Sweep sweep_of(const Mesh& mesh);
// Numbers such that two constraints with a common vertex differ.
template <std::size_t N>
std::vector<int32_t> colours_of(const std::vector<std::array<int32_t, N>>& constraints, int32_t vertices);

// The constraints of a sweep, in its order.
struct Constraints {
  std::vector<double> length, distance_compliance;  // [edges] m, m/N
  std::vector<double> volume, volume_compliance;    // [cells] m³, m³/Pa
};
Constraints constraints_of(const Mesh& mesh, const Sweep& sweep, const Stiffness& stiffness);

// Mass of each vertex [vertices]: a quarter of that of each tetrahedron around it. Where that is nothing, `alone`, the
// mass of the scene's particle.
std::vector<double> masses_of(const Mesh& mesh, double density, const std::vector<double>& alone);
// kg/m³: the scene's mass over the volume of its tetrahedra, where there are any.
double density_of(const Scene& scene, const Mesh& mesh);

// Appends new vertices: held where both ends of their edge are.
void hold_new(const Mesh& mesh, std::vector<uint8_t>& held);
// Coupling groups of a frame: the corners of each tetrahedron, the ends of each link. They are not given as cells,
// because runs have a fixed number of these.
void couple(const Mesh& mesh, Frame& frame);

// Projections of one constraint (XPBD, equations 17 and 18): move the ends `x` by their inverse masses `w` and add to
// the multiplier. `compliance` is already divided by dt². Degenerate constraints move nothing.
void project_distance(std::array<Vec3*, 2> x, std::array<double, 2> w, double length, double compliance,
                      double& multiplier);
// C = (x₁ - x₀) × (x₂ - x₀) · (x₃ - x₀) / 6 - volume.
void project_volume(std::array<Vec3*, 4> x, std::array<double, 4> w, double volume, double compliance,
                    double& multiplier);

// Energy of the constraints [J].
double elastic_energy(const Sweep& sweep, const Constraints& constraints, std::span<const Vec3> x);

// Which edges the patch crosses where vertices lie at `x`. A new vertex that is nearer to the blade than `thickness`
// [m] counts as on the side of its parent: a blade that comes again along a cut takes nothing off. A point in the plane
// counts as on the positive side, and borders belong to the patch.
std::vector<Crossing> crossings(const Mesh& mesh, std::span<const Vec3> x, const Patch& patch, double thickness);

}  // namespace tets
}  // namespace cutproof::baselines
