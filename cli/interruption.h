// Signals that ask the program to end: INT, TERM, HUP, QUIT, and PIPE, after the reader of the output has closed.
//
// No signal leaves a file half written (io::Unfinished). A subcommand may declare that it can end in order: the first
// signal then is a request, and the subcommand writes its results so far; the second ends it at once. Every other
// subcommand ends at once. Either way the program ends by that signal, which a shell reports as 128 + its number. A
// limit on the size of files (XFSZ) is an error of writing, as a full disk is.
#pragma once

namespace cutproof::cli {

// To be called once, before anything else. A signal that the program's parent has set to be ignored, as nohup does with
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
