// What a criterion of detection demands of a particle. Internal to oracles/.
#pragma once

namespace cutproof::oracles {

enum class Demand { keep, either, remove };  // either: rounding decides

}  // namespace cutproof::oracles
