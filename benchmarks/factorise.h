// Ways of having a factor of a system that a cut has changed.
#pragma once
#include <cstdint>
#include <optional>
#include <vector>

#include "benchmarks/system_change.h"

namespace cutproof::benchmarks {

enum class Way {
  analyse,  // as if nothing had been there before
  ordered,  // elimination order kept, a new row after its origin: symbolic and numeric factorisation
  numeric,  // symbolic factorisation kept: only where the changed system has no entry that was not there
  updown,   // rank-one changes: one for each mass that differs and for each set of clusters whose weight differs
  rows,     // each changed row deleted from the factor and added again
};
inline constexpr Way kWays[] = {Way::analyse, Way::ordered, Way::numeric, Way::updown, Way::rows};
inline constexpr const char* kWayNames[] = {"analyse", "ordered", "numeric", "updown", "rows"};
constexpr const char* name_of(Way way) { return kWayNames[static_cast<std::size_t>(way)]; }

struct Factorised {
  double seconds = 0;        // of everything after the changed system is known
  double solve_seconds = 0;  // of one right-hand side
  double residual = 0;       // ‖right − B x‖ / (‖B‖ ‖x‖) in the greatest norm
  int64_t entries = 0;       // of the factor
  std::vector<double> x;     // [rows]
};
// Nothing where the way does not exist. What the earlier factor takes is not in the times; for `updown` and `rows` it
// is in the form and has the order that they need, with the new rows in it.
std::optional<Factorised> factorise(const SystemChange& change, Way way, const std::vector<double>& right);

// By how much the residual may differ from 0 (tolerances.md, Residual of a factor).
double residual_bound(const SystemChange& change, Way way);

}  // namespace cutproof::benchmarks
