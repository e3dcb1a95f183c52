#pragma once

namespace hapticd::hal {
class Rig;
}

namespace hapticd::server {

/// What is still done when the process crashes (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT and with it
/// std::terminate, SIGSYS, SIGTRAP): one zero force through the rig's driver where that has a way for it,
/// then the default action (core dump, end by that signal). A device whose driver is itself where the crash
/// is, a kernel that stops, SIGKILL and a power failure are the matter of the device's own watchdog.
void install_crash_handlers();

/// The rig whose device gets the zero; null: none. It must be there until another call takes it back. Any
/// thread.
void write_zero_in_crash_of(hal::Rig* rig);

/// A stack of its own for the handlers, so that they run also when this thread has used up its stack. Lasts
/// as long as the thread; called again it does nothing.
void use_crash_stack() noexcept;

}  // namespace hapticd::server
