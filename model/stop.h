// Requests to stop long work, and its end.
#pragma once
#include <functional>

namespace cutproof {

// Called between pieces of work, from any thread; empty: the work is never stopped. Once true, the answer stays true.
using StopAsked = std::function<bool()>;

// Thrown through work that was asked to stop. Not a std::exception, so that handlers of faults do not catch it.
class Stopped {};

inline bool is_asked(const StopAsked& stop_asked) { return stop_asked && stop_asked(); }
inline void throw_if_asked(const StopAsked& stop_asked) {
  if (is_asked(stop_asked)) throw Stopped();
}

}  // namespace cutproof
