// Hexahedral corotational finite elements with implicit Euler, after Wu et al.; docs/baselines/fem.md.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "baselines/dissection.h"
#include "baselines/fem/fem_mesh.h"

namespace cutproof::baselines {

namespace fem {

struct Settings {
  double youngs_modulus = 0;   // Pa
  double poisson_ratio = 0;    // above -1, below 0.5
  double density = 0;          // kg/m³; 0: masses of the scene
  double damping = 0;          // 1/s: velocities decay by this rate
  double rayleigh = 0;         // s: D = rayleigh · K̂
  int steps = 4;               // of implicit Euler in a frame
  int newton = 1;              // Newton steps in each; 1: semi-implicit, as published
  int solver = 0;              // of the CPU program: 0 CHOLMOD, 1 conjugate gradients
  double tolerance = 1e-6;     // of conjugate gradients: residual in the preconditioner's norm, relative
  int iterations = 2000;       // of them at most
  int grids = 8;               // coarser ones of the kernels' multigrid, at most; 0: block Jacobi alone
  int refine = 1;              // each hexahedron becomes refine³
  bool removes_cells = false;  // the blade deletes the cells that it meets, and cuts no links
};
// Names of the plugin's parameters, with defaults.
std::map<std::string, double> known_parameters();
// Throws std::invalid_argument for a value outside its range. `spacing` in m: youngs_modulus 0 means 2e7 Pa/m² ·
// spacing².
Settings settings_of(const Parameters& parameters, double spacing);

// Lamé's parameters, Pa.
struct Lame {
  double mu = 0, lambda = 0;
};
Lame lame_of(double youngs_modulus, double poisson_ratio);

using Vector24 = Eigen::Matrix<double, 24, 1>;  // corner by corner
using Matrix24 = Eigen::Matrix<double, 24, 24>;

// A cell at rest, at 2 × 2 × 2 Gauss points.
struct Element {
  std::array<Corners, 8> gradients;  // of the corners' shape functions, 1/m
  std::array<double, 8> volumes;     // m³, of the points
  double volume = 0;                 // m³, of the cell
};
Element element_of(const Corners& rest);

// W = Σ_g V_g μ |F_g − R_g|² + V λ/2 θ̄², θ̄ = Σ_g V_g tr(R_gᵀ F_g − I) / V, where R_g is the rotation nearest to F_g.
// The volumetric term takes the cell's mean (B-bar: Hughes, The Finite Element Method, 1987, section 4.5), which avoids
// locking. In joules.
double energy_of(const Element& element, Lame lame, const Corners& x);

// f = −∂W/∂x in N, and K = ∂²W/∂x² in N/m. With `projected` negative eigenvalues at each Gauss point become zero (Smith
// et al., Analytic Eigensystems for Isotropic Distortion Energies, 2019, section 4).
struct Linearised {
  Vector24 force;
  Matrix24 stiffness;
};
Linearised linearise(const Element& element, Lame lame, const Corners& x, bool projected = true);

// The greatest eigenvalue of D⁻¹K of a cell at rest, D the 3 × 3 diagonal blocks of K. It bounds that of a mesh of such
// cells.
double greatest_of_jacobi(const Corners& rest, Lame lame);

// Places of the mesh's nodes in equilibrium with `load` [p] N, from the places `x` [p] m; held nodes stay. Newton's
// method with halved steps while the energy would grow. Throws std::runtime_error where it does not converge.
std::vector<Vec3> equilibrium(const Mesh& mesh, Lame lame, const std::vector<Vec3>& load, std::vector<Vec3> x);

// Of a simulator of this file: elastic, kinetic and potential energy, J; zero height is the origin.
double energy_of(const Mesh& mesh, Lame lame, const Vec3& gravity, const Frame& frame);

}  // namespace fem

// Throw std::invalid_argument for parameters out of range and for cells without volume; what they return throws
// std::runtime_error when the motion is no longer finite.
std::unique_ptr<Simulator> make_fem_cpu(const Scene& scene, const Parameters& parameters);
std::unique_ptr<Simulator> make_fem_host(const Scene& scene, const Parameters& parameters);
#ifdef BASELINES_HAVE_CUDA
std::unique_ptr<Simulator> make_fem_cuda(const Scene& scene, const Parameters& parameters);
#endif

}  // namespace cutproof::baselines
