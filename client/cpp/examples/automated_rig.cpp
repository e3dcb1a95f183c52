// A test rig without a person: the simulated hand presses an object at several targets, and the stiffness
// felt is compared with the one granted.
//   automated_rig [ADDRESS]      exit code 0: all within 10 %; 1: one is not, the guard latched, or an error
#include <chrono>
#include <cmath>
#include <cstdio>
#include <thread>

#include "client/cpp/client.h"

namespace v1 = hapticd::v1;

/// Waits until the hand presses steadily; false after ten seconds, or if the guard took the force away.
bool await_press(hapticd::client::Client& client, double force_n, v1::RigState& state) {
  for (int tries = 0; tries < 200; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    state = client.rig_state(hapticd::client::Histograms::kWithout);
    if (state.guard_state() == v1::GUARD_STATE_LATCHED) return false;
    if (state.in_contact() && std::abs(state.hand_force_n() - force_n) < 0.05 * force_n) return true;
  }
  return false;
}

int main(int argc, char** argv) try {
  hapticd::client::Client client({.address = argc > 1 ? argv[1] : "127.0.0.1:50051",
                                  .acquires_lease = true,
                                  .lease_purpose = "automated test"});
  client.load_scene({.name = "tap_1d"});
  bool all_good = true;
  for (const double target_n_per_mm : {0.3, 0.5, 0.8}) {
    v1::SetTargetRequest target;
    target.set_stiffness_n_per_mm(target_n_per_mm);
    const double granted_n_per_mm = client.set_target(target).granted_n_per_mm();
    v1::HandProgram hand;
    hand.set_kind(v1::HAND_PROGRAM_KIND_PRESS);
    hand.set_force_n(2.0);
    hand.set_hold_s(-1.0);  // until the next program
    client.set_hand_program(hand);
    v1::RigState state;
    const bool pressed = await_press(client, 2.0, state);
    if (state.guard_state() == v1::GUARD_STATE_LATCHED) {
      std::fprintf(stderr, "the guard is latched (%s): see to its cause, then hapticctl clear\n",
                   v1::GuardFault_Name(state.guard_fault()).c_str());
      return 1;
    }
    const double felt_n_per_mm = pressed ? state.hand_force_n() / state.displacement_mm() : 0.0;
    const bool good = std::abs(felt_n_per_mm / granted_n_per_mm - 1.0) < 0.1;
    std::printf("%s: granted %.2f N/mm, felt %.2f N/mm\n", good ? "good" : "BAD", granted_n_per_mm,
                felt_n_per_mm);
    all_good = all_good && good;
    hand.set_kind(v1::HAND_PROGRAM_KIND_REST);
    client.set_hand_program(hand);  // off the object before the next target
    client.wait_for_hand(std::chrono::seconds(10));
  }
  return all_good ? 0 : 1;
} catch (const hapticd::client::Error& error) {
  // A program branches on the reason; the text is for people.
  const bool busy = error.detail().reason() == v1::ERROR_REASON_BUSY;
  std::fprintf(stderr, "%s%s\n", error.what(), busy ? " (try again later)" : "");
  return 1;
}
