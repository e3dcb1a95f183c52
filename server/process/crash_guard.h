#pragma once

namespace hapticd::hal {
class Rig;
}

namespace hapticd::server {

/// Last actions when the process crashes (SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT and with it
/// std::terminate, SIGSYS, SIGTRAP): one zero force through the rig's driver if the driver supports it,
/// then the default action (core dump, end by that signal). If the crash is in the
/// driver itself, and for a kernel that stops, SIGKILL and a power failure, only the device's own watchdog
/// helps.
void install_crash_handlers();

/// Sets the rig whose device gets the zero; null: none. It must live until another call replaces it. Any
/// thread.
void write_zero_in_crash_of(hal::Rig* rig);

/// Gives the handlers a separate stack in this thread, so that they run also when its stack is used up. Lasts
/// as long as the thread; a second call does nothing.
void use_crash_stack() noexcept;

}  // namespace hapticd::server
