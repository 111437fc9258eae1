#include "baselines/mpm/mpm_kernels.h"

namespace cutproof::baselines {}
