// Signals that ask the program to end: INT, TERM, HUP, QUIT, and PIPE, where nobody reads what it prints any more.
//
// No signal leaves a file half written (io::Unfinished). A verb that can end in order says so: the first signal then
// only asks, and the verb writes what it has; the second ends it at once. Every other verb ends at once. Either way the
// program ends by that signal, which a shell reports as 128 + its number. A limit on the size of files (XFSZ) is an
// error of writing, as a full disk is.
#pragma once

namespace cutproof::cli {

// To be called once, before anything else. A signal that whoever started the program has it ignore, as nohup does with
// HUP, stays ignored.
void handle_signals();

// As long as one of these lives, a signal asks to stop. One at a time.
class EndsInOrder {
 public:
  EndsInOrder();
  ~EndsInOrder();
  EndsInOrder(const EndsInOrder&) = delete;
  EndsInOrder& operator=(const EndsInOrder&) = delete;
};
// Whether a signal has asked. From any thread.
bool stop_asked() noexcept;

// Ends the program by the signal that asked. Requires stop_asked().
[[noreturn]] void end_by_signal() noexcept;

}  // namespace cutproof::cli
