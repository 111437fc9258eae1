// The demand of a detection criterion on a particle. Internal to oracles/.
#pragma once

namespace cutproof::oracles {

enum class Demand { keep, either, remove };  // either: rounding decides

}  // namespace cutproof::oracles
