#include "baselines/dissection.h"
#include "baselines/parallel.h"

namespace cutproof::baselines {

void require_device() { const Device device; }

}  // namespace cutproof::baselines
