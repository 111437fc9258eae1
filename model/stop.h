// How work that takes long learns that it is to stop, and how it then ends. Who asks, and why, is not its business.
#pragma once
#include <functional>

namespace cutproof {

// Asked between pieces of work, from any thread; empty: nobody will ask. Once true, it stays true.
using StopAsked = std::function<bool()>;

// Thrown through work that was asked to stop, to whoever asked. No std::exception: it is no fault, and nothing that
// catches faults is to take it for one.
class Stopped {};

inline bool is_asked(const StopAsked& stop_asked) { return stop_asked && stop_asked(); }
inline void throw_if_asked(const StopAsked& stop_asked) {
  if (is_asked(stop_asked)) throw Stopped();
}

}  // namespace cutproof
