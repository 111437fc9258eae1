// A method as a plugin. NAME/NAME_plugin.cpp defines kMethod, and plugin.cpp the functions of the plugin. CMake
// compiles both for each program of the method, with PROGRAM as cpu, host or cuda.
#pragma once
#include <memory>

#include "baselines/dissection.h"

#define BASELINES_JOINED_(a, b) a##b
#define BASELINES_JOINED(a, b) BASELINES_JOINED_(a, b)
#define BASELINES_TEXT_(word) #word
#define BASELINES_TEXT(word) BASELINES_TEXT_(word)

namespace cutproof::baselines {

struct Method {
  const char *name, *promises, *limits;  // docs/reference/plugins.md
  // Throws std::invalid_argument, with a sentence that names the parameter.
  Parameters (*read)(const char* text);
  // Throws std::invalid_argument for a scene that it does not take, std::runtime_error where a state has no numbers.
  std::unique_ptr<Simulator> (*make)(const Scene& scene, const Parameters& parameters);
};
extern const Method kMethod;

}  // namespace cutproof::baselines
