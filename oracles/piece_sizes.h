// Sizes of the pieces of a partition, in words, for witnesses.
#pragma once
#include <string>

#include "oracles/partitions.h"

namespace cutproof::oracles {

// Such as "3 pieces (of 512, 480 and 3 particles)", the largest first, and no more than a few of them.
std::string pieces_in_words(const Partition& partition);

}  // namespace cutproof::oracles
