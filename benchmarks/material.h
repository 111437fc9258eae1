// Bars of a material, and what is measured of them beside closed forms (method.md §3, Volume).
#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "model/backend.h"
#include "model/scene.h"

namespace cutproof::benchmarks {

struct BarSpec {
  std::string along = "100";  // its axis in the grid: 100 (a square section), 110 or 111 (round ones)
  Cooking cooking = Cooking::tiles;
  int32_t side = 2;  // of clusters
  double poisson_ratio = 0;
  int32_t across = 10;     // nodes; it is kSlenderness times as long
  int32_t iterations = 0;  // of a substep; 0: as many as leave a thousandth of a long wave's error
};
inline constexpr int32_t kSlenderness = 5;

// What is measured, beside what the scene asks or a closed form says.
struct MaterialFigure {
  std::string test, quantity, unit;
  double asked = 0, measured = 0;
};

// A bar of 10 kPa and 1,000 kg/m³ on a grid of 1 cm, whose first layer is held. Linear but for pull().
class MaterialBar {
 public:
  MaterialBar(Backend& backend, BarSpec spec);
  int32_t particles() const { return setup_.body.particle_count(); }
  int64_t clusters() const { return state_.clusters.count(); }

  // It hangs, stretched by 1 % in its middle: Young's modulus and Poisson's ratio there.
  std::vector<MaterialFigure> hang();
  // Its free end is pulled away by a fifth of the length: volume of the middle, of that at rest, beside a bar of
  // constant ν in logarithmic strain.
  MaterialFigure pull();
  // It is struck along, round or across its axis: the modulus that gives the first frequency. A bar of given iterations
  // is asked for (1 - λ) E (fixtures/material.h).
  MaterialFigure swing_along();
  MaterialFigure twist();
  MaterialFigure swing_across();
  // Struck along, with retardation: what its decay says of that [s].
  MaterialFigure decay();

 private:
  struct Oscillation {
    double frequency = 0, retardation = 0;  // [rad/s], [s]
    double left = 0;                        // λ
    double of_closed_form = 0;
  };
  double place(int32_t particle) const;  // along the axis, from the held layer [m]
  // At most the longest step in which Chebyshev's iteration converges fast.
  double step_length(double longest) const;
  Setup in_steps(double dt, int64_t frames, double retardation = 0) const;
  State run(Setup setup, State state, const std::function<void(const State&)>& see = {});
  // Of the motion that begins with velocities in the shape `mode`, over half a period.
  Oscillation oscillation(const std::function<Vec3(int32_t)>& mode, double expected, double retardation);
  // Along the axis, retarded by this share of 1 / ω.
  Oscillation swing(double share);
  // Of the middle: derivative of places by places at rest.
  Mat3 deformation_of_middle(const State& state) const;

  Backend& backend_;
  BarSpec spec_;
  Vec3 axis_;
  Setup setup_;
  State state_;
  double low_ = 0, middle_ = 0, length_ = 0;  // of the held layer, on the axis; from there to middle and free end [m]
  double area_ = 0;                           // [m²]
};

}  // namespace cutproof::benchmarks
