// A backend that offers only some of the spans that another can run: what a guest looks like whose kernels do whole
// frames and nothing else, or one stage of six.
#pragma once
#include <memory>
#include <string>

#include "model/backend.h"

namespace cutproof::harness {

// `can_run` says which spans of `inner` are offered. Running another one throws std::logic_error.
std::unique_ptr<Backend> offer_only(std::unique_ptr<Backend> inner, std::string name, bool (*can_run)(Span));

}  // namespace cutproof::harness
