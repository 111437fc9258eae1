// Precision of an arithmetic. The bounds of the oracles follow from it (docs/design/tolerances.md).
#pragma once

namespace cutproof {

enum class Precision { binary64, binary32 };  // IEEE 754; the coarser one is the greater

// u: the greatest relative error of one rounding.
constexpr double unit_roundoff(Precision precision) { return precision == Precision::binary64 ? 0x1p-53 : 0x1p-24; }

}  // namespace cutproof
