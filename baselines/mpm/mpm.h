// Material points after Hu et al. 2018, "A moving least squares material point method with displacement discontinuity
// and two-way rigid body coupling": MLS-MPM with APIC, and compatible particle-in-cell (CPIC) against a thin plate.
//
// The plate is the patch that the blade sweeps in a frame. Points on one side of it do not share grid nodes with points
// on the other side. The parameter `labels` says what is left of a cut when the plate is gone: with 0 nothing, as
// published; with 1 each component of unbroken tissue edges has a grid of its own for good.
//
// Lengths are in m, times in s, masses in kg.
#pragma once
#include <Eigen/Dense>
#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "baselines/dissection.h"

namespace cutproof::baselines {

// Throw std::invalid_argument for parameters and scenes that are out of range, and std::runtime_error where a state is
// no longer finite. The device's program throws std::runtime_error without a device, std::bad_alloc without memory.
std::unique_ptr<Simulator> make_mpm_cpu(const Scene& scene, const Parameters& parameters);   // double precision
std::unique_ptr<Simulator> make_mpm_host(const Scene& scene, const Parameters& parameters);  // single precision
#ifdef BASELINES_HAVE_CUDA
std::unique_ptr<Simulator> make_mpm_cuda(const Scene& scene, const Parameters& parameters);  // the same on a device
#endif

namespace mpm {

using Mat3 = Eigen::Matrix3d;

// Names and defaults:
//   youngs_modulus  Pa; 0: 2e7 spacing² Pa, which is as stiff at each size of a scene
//   poisson_ratio   in (-1, 0.5)
//   density         kg/m³, gives the volumes of points from their masses; 0: a point has the volume spacing³
//   steps           substeps of a frame at least; there are more where the speed of pressure waves demands it
//   damping         1/s, of velocities
//   cell            dx, the grid's spacing, in spacings of the scene
//   labels          0: the cut heals when the plate leaves, as published; 1: pieces keep grids of their own
//   friction        of the plate, by Coulomb's law
//   push            drives points that are behind the plate back; 1: with the rate c / dx, c the speed of waves
std::map<std::string, double> known_parameters();
// Throws std::invalid_argument with a sentence that names the parameter.
void require_in_range(const Parameters& parameters);

// What a scene and parameters come to. Requires parameters in range.
struct Settings {
  double cell = 0;            // dx [m]
  double mu = 0, lambda = 0;  // Lamé's [Pa]
  double rate = 0;            // c / dx [1/s], c = sqrt((λ + 2 μ) / ρ) of the lightest point
  double damping = 0, friction = 0, push = 0;
  int substeps = 1;  // of a frame: a wave passes at most 0.3 dx in one
  bool keeps_labels = true;
  std::vector<double> volume;  // V₀ of each point [m³]
};
Settings settings_of(const Scene& scene, const Parameters& parameters);

// The plate of one patch at some time. It moves as the tissue was thrown, so that it lies in the tissue all the way and
// ends the frame where the scene says: with the velocity that the centre of mass had at the start, and falling. Where
// particles are held it stands still.
struct Plate {
  Patch patch;
  Vec3 velocity;  // [m/s]
};
// On the way to a frame as a substep of it begins; substep = substeps: at the frame's end.
std::vector<Plate> plates_at(const Scene& scene, int frame, int substep, int substeps);
// For each plate of a frame which plate of the frame before it continues: k + 1, or -(k + 1) if its sides have changed
// places, or 0 if it is new. A plate goes on where it lies in the plane of an old one, within 0.05 `cell`.
std::vector<int32_t> continued_plates(const Scene& scene, int frame, int substeps, double cell);

// Quadratic B-splines of a point: node k is base + (k / 9, k / 3 % 3, k % 3), at `cell` times that. Hu et al. 2018,
// section 3; the weights w sum to 1, and Σ w (x_i - x_p) = 0.
struct Stencil {
  std::array<int32_t, 3> base;
  std::array<double, 27> weight;
};
Stencil stencil_of(const Vec3& x, double cell);
std::array<int32_t, 3> node_of(const Stencil& stencil, int k);
inline Vec3 place_of(const std::array<int32_t, 3>& node, double cell) { return cell * Vec3(node[0], node[1], node[2]); }

// The rotation R with the greatest tr(RᵀF); of F = U Σ Vᵀ, U Vᵀ with the sign of the least singular value's vector
// changed where that is a reflection.
Mat3 rotation_of(const Mat3& deformation);
// Fixed corotated material (Stomakhin et al. 2012): ψ = μ |F - R|² + λ / 2 (J - 1)² [J/m³],
// P = ∂ψ/∂F = 2 μ (F - R) + λ (J - 1) J F⁻ᵀ, and Kirchhoff's stress P Fᵀ, which needs no inverse [Pa].
double energy_density(const Mat3& deformation, double mu, double lambda);
Mat3 kirchhoff_stress(const Mat3& deformation, double mu, double lambda);

// Where a place is against a plate: `side` 1 along the plate's normal, -1 against it, or 0 where the foot of the
// perpendicular lies outside the patch, or farther than `reach`.
struct Near {
  int side = 0;
  double distance = 0;  // along the normal [m]
  Vec3 normal = Vec3::Zero();
};
Near near_plate(const Patch& patch, const Vec3& x, double reach);

struct Points {
  std::vector<Vec3> x, v;            // [n] m, m/s
  std::vector<Mat3> affine;          // [n] C of APIC [1/s]
  std::vector<Mat3> deformation;     // [n] F
  std::vector<double> mass, volume;  // [n] kg, m³ at rest
  std::vector<int32_t> label;        // [n] points of different labels share no node
  std::vector<uint8_t> held;         // [n]
  std::vector<Near> contact;         // [n x plates] side, and distance and normal of the fitted plane
  std::vector<Vec3> impulse;         // [n] what plates and grips gave since it was cleared [kg m/s]
};
struct Grid {
  double cell = 0;
  std::vector<std::array<int32_t, 4>> node;            // [nodes] label, then x, y, z
  std::vector<double> mass;                            // [nodes]
  std::vector<double> held_mass;                       // [nodes] of held points
  std::vector<Vec3> velocity;                          // [nodes] momentum until grid_velocities() [kg m/s], then m/s
  std::vector<Near> contact;                           // [nodes x plates]
  std::vector<Stencil> stencil;                        // [n]
  std::vector<std::array<int32_t, 27>> node_of_point;  // [n] numbers of nodes, in the stencil's order
};
// Nodes and weights of all points.
Grid grid_of(const Points& points, double cell);
// Sides of nodes and points. A point keeps its side while the plate is near; a new one takes the side with the greater
// Σ w d, and all get distance and normal from the plane that fits the nodes' distances with the least squares.
void colour(Grid& grid, Points& points, const std::vector<Plate>& plates);
// Whether node k of a point's stencil may hear of the point: no plate has them on different sides.
bool is_compatible(const Grid& grid, const Points& points, std::size_t point, int k);
// P2G: mass and momentum of compatible points, with the impulse of stresses in dt.
void to_grid(Grid& grid, const Points& points, const Settings& settings, double dt);
// A node is clamped where held points have more than this share of its mass. Held points that only lost their own
// velocity would drag at shared nodes, and tissue would creep. A node half a cell beyond the surface of a held half
// space has a sixth, so that the clamp lies at the surface within half a cell.
constexpr double kClampedShare = 0.17;
bool is_clamped(const Grid& grid, std::size_t node);
void grid_velocities(Grid& grid, const Vec3& gravity, double dt);
// G2P, and the motion of points in dt. At incompatible nodes a point finds its own velocity, projected against the
// plate.
void to_points(const Grid& grid, Points& points, const Settings& settings, const std::vector<Plate>& plates,
               const Vec3& gravity, double dt);
// All of these.
void substep(Points& points, const Settings& settings, const std::vector<Plate>& plates, const Vec3& gravity,
             double dt);
// Coupling groups: for each node the compatible points with weights, of which the greatest is 1.
void add_groups(const Grid& grid, const Points& points, Frame& frame);

// Two blocks with a gap between their nearest points, in cells of the grid, and no plate: the state after a blade has
// been withdrawn. One is kicked, and the other's centre of mass gains this share of the kick in a frame.
using Factory = std::unique_ptr<Simulator> (*)(const Scene& scene, const Parameters& parameters);
double kick_felt_across(Factory make, double gap, int labels);

}  // namespace mpm
}  // namespace cutproof::baselines
