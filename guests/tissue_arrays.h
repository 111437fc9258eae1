// A body at rest as the arrays of cutproof_tissue (cutproof/plugin.h), for questions and for stages alike.
#pragma once
#include "guests/guest.h"
#include "model/body.h"

namespace cutproof::guests {

// edge_offsets, edge_ends, rest, mass; on a grid node and nodes; spacing. Real numbers are f64.
Arrays tissue_arrays(const Body& body);

// Arrays of a tissue as a guest gets them: real numbers in its precision. Spacing and nodes are members of the tissue
// itself, so they keep theirs, and the guest finds them by their names.
Array in_precision_of_tissue(const Array& array, Precision precision);
Argument given_of_tissue(const Array& array);

}  // namespace cutproof::guests
