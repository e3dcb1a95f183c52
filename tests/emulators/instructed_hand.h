#pragma once

#include <fstream>
#include <optional>
#include <string>

#include "hal/sim/hand/hand.h"

namespace hapticd::emulators {

/// A person who does what an identification asks for, and knows no more than its words: they are read from
/// the lines that `hapticctl --json identify ... > FILE` writes; or what the page of an experiment asks a
/// participant for, as tests/python/answering_page.py writes it. Rests while there is nothing to read.
class InstructedHand {
 public:
  explicit InstructedHand(std::string file) : file_(std::move(file)) {}

  /// Reads on. True if other words came, apart from how far a thing has come.
  bool read();
  /// What is to be done now; the same words again are done a little differently, as a person would.
  sim::HandProgram next();
  /// Whether a person would not end first what is being done: "let go", or while the device leads the tool.
  bool acts_at_once() const;

 private:
  std::string file_;
  std::streamoff read_to_ = 0;
  std::string words_;
  unsigned tries_ = 0;  ///< with these words
  bool follows_ = false;
};

/// The motion that the words ask for, for the so manieth time. At rest if they ask for none.
sim::HandProgram motion_for(const std::string& words, unsigned tries);

}  // namespace hapticd::emulators
