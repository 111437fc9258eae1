// The fixed point of an implicit substep with a blade and friction, for fixed rotations (method.md §3): the t for which
// every particle is where contacts put it and every t is its cluster's mean. Internal to oracles/.
#pragma once
#include <memory>
#include <vector>

#include "oracles/comparison/substep_problem.h"

namespace cutproof::oracles {

// Newton's method on t. A particle is at Π(x~ + s (g(t) − x~)), where Π projects to allowed places. So t is fixed where
// `Σ_i w_ic Π_i − M_c t_c = 0`, with the derivative `−(diag(M) − s Σ_i w_i / n_i u_i u_iᵀ ⊗ Π'_i)`. Π is the nearest
// point of a closed set but for friction, and where blade and walls act in turn; then it is the gradient of a convex
// function (Asplund 1973), so Π' is symmetric and nowhere negative, and the derivative is the Hessian of E over x and t
// within the contacts, scaled. Its factor by CHOLMOD says that the point is a strict minimum. With friction Π' is not
// symmetric, and a sparse LU takes its place.
class ContactStage {
 public:
  explicit ContactStage(const SubstepProblem& problem);
  ~ContactStage();

  struct Rest {
    std::vector<Vec3> x, free;  // [n] where particles are, and where they would go [m]
    bool found = false;         // t moves by rounding alone
  };
  // From where centers [m] are at `center`, which then are where they came to rest.
  Rest rest(const Poses& poses, std::vector<Vec3>& center);

  // Whether particles are at a strict minimum of E over x and t. With friction there is no minimum; where blade and
  // walls act in turn, this is not known.
  bool is_strict_minimum(const Rest& rest);

 private:
  class Linear;
  struct Places {
    std::vector<Vec3> free, x;  // [n] [m]
    std::vector<Vec3> left;     // [m] Σ w x / M − t [m]
    double most = 0;            // of its lengths
  };
  Places places(const std::vector<Vec3>& turned, const std::vector<Vec3>& center) const;

  const SubstepProblem& problem_;
  std::vector<double> mass_;        // [m] M_c
  double at_rest_ = 0;              // [m]
  std::unique_ptr<Linear> linear_;  // the last one, as long as it serves
};

}  // namespace cutproof::oracles
