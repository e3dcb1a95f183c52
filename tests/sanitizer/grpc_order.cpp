// These functions tell ThreadSanitizer what happens before what in gRPC, which is not instrumented. A program that has
// them calls them instead of those of gRPC's and Abseil's libraries, and each calls the one whose place it takes. They are
// linked only under ThreadSanitizer, for gRPC 1.51 and Abseil 20220623 of Debian 12.
#include <absl/status/status.h>
#include <absl/synchronization/mutex.h>
#include <dlfcn.h>
#include <grpc/grpc.h>
#include <grpcpp/support/server_callback.h>
#include <sanitizer/tsan_interface.h>

#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

namespace {

/// Finds the function that has this name in the libraries behind this one.
template <class Function>
Function* behind_this(const std::string& name) {
  void* found = dlsym(RTLD_NEXT, name.c_str());
  if (found == nullptr) {
    std::fprintf(stderr,
                 "grpc_order: no library has %s: it fits the gRPC and Abseil of Debian 12; build without "
                 "HAPTICD_SANITIZER=thread\n",
                 name.c_str());
    std::abort();
  }
  return reinterpret_cast<Function*>(found);
}

#define HAPTICD_TEXT_OF(name) #name
#define HAPTICD_TEXT(name) HAPTICD_TEXT_OF(name)

/// The name of a member of Abseil as the linker has it.
std::string absl_name(const char* member) {
  const std::string inner = HAPTICD_TEXT(ABSL_OPTION_INLINE_NAMESPACE_NAME);
  return "_ZN4absl" + std::to_string(inner.size()) + inner + member;
}

/// One batch of a call, from the thread that starts it to the one that learns of its end.
void before(void* tag) {
  if (tag != nullptr) __tsan_release(tag);
}
grpc_event after(const grpc_event& event) {
  if (event.type == GRPC_OP_COMPLETE && event.tag != nullptr) __tsan_acquire(event.tag);
  return event;
}

/// Place of the order of all bytes that were received, which pass between threads behind atomics: a thread
/// that reads a message comes after all that passed one on. Calls that follow one another are ordered a
/// little more than they are; those under way at the same time are not.
char received;

}  // namespace

extern "C" {

grpc_call_error grpc_call_start_batch(grpc_call* call, const grpc_op* ops, size_t count, void* tag,
                                      void* reserved) {
  static auto* const start = behind_this<decltype(grpc_call_start_batch)>("grpc_call_start_batch");
  before(tag);
  return start(call, ops, count, tag, reserved);
}

/// Reads a message that was received, whichever thread did that.
int grpc_byte_buffer_reader_init(grpc_byte_buffer_reader* reader, grpc_byte_buffer* buffer) {
  static auto* const begin =
      behind_this<decltype(grpc_byte_buffer_reader_init)>("grpc_byte_buffer_reader_init");
  __tsan_acquire(&received);
  return begin(reader, buffer);
}

grpc_event grpc_completion_queue_next(grpc_completion_queue* queue, gpr_timespec deadline, void* reserved) {
  static auto* const next = behind_this<decltype(grpc_completion_queue_next)>("grpc_completion_queue_next");
  return after(next(queue, deadline, reserved));
}

grpc_event grpc_completion_queue_pluck(grpc_completion_queue* queue, void* tag, gpr_timespec deadline,
                                       void* reserved) {
  static auto* const pluck =
      behind_this<decltype(grpc_completion_queue_pluck)>("grpc_completion_queue_pluck");
  return after(pluck(queue, tag, deadline, reserved));
}

grpc_call_error grpc_server_request_call(grpc_server* server, grpc_call** call, grpc_call_details* details,
                                         grpc_metadata_array* metadata, grpc_completion_queue* of_call,
                                         grpc_completion_queue* of_news, void* tag) {
  static auto* const request = behind_this<decltype(grpc_server_request_call)>("grpc_server_request_call");
  before(tag);
  return request(server, call, details, metadata, of_call, of_news, tag);
}

grpc_call_error grpc_server_request_registered_call(grpc_server* server, void* method, grpc_call** call,
                                                    gpr_timespec* deadline, grpc_metadata_array* metadata,
                                                    grpc_byte_buffer** payload,
                                                    grpc_completion_queue* of_call,
                                                    grpc_completion_queue* of_news, void* tag) {
  static auto* const request =
      behind_this<decltype(grpc_server_request_registered_call)>("grpc_server_request_registered_call");
  before(tag);
  return request(server, method, call, deadline, metadata, payload, of_call, of_news, tag);
}

/// Abseil's own search for deadlocks keeps a graph behind a lock that is not seen either.
[[gnu::constructor]] void search_no_deadlocks() {
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
}

}  // extern "C"

struct grpc_closure;
struct grpc_cq_completion;

/// Ends an operation, in the thread in which gRPC has done it.
void grpc_cq_end_op(grpc_completion_queue* queue, void* tag, absl::Status error,
                    void (*done)(void*, grpc_cq_completion*), void* argument, grpc_cq_completion* storage,
                    bool internal) {
  static auto* const end = behind_this<decltype(grpc_cq_end_op)>(
      "_Z14grpc_cq_end_opP21grpc_completion_queuePv" + absl_name("6StatusE").substr(2) +
      "PFvS1_P18grpc_cq_completionES1_S6_b");
  before(tag);
  end(queue, tag, std::move(error), done, argument, storage, internal);
}

struct tsi_frame_protector;

/// Ends the encryption of a connection, after all that used it.
void tsi_frame_protector_destroy(tsi_frame_protector* protector) {
  static auto* const destroy = behind_this<decltype(tsi_frame_protector_destroy)>(
      "_Z27tsi_frame_protector_destroyP19tsi_frame_protector");
  __tsan_acquire(&received);
  destroy(protector);
}

// How bytes that were received reach their call.
namespace grpc_core {

class Combiner {
 public:
  void Run(grpc_closure* closure, absl::Status error);
};

void Combiner::Run(grpc_closure* closure, absl::Status error) {
  static auto* const run = behind_this<void(Combiner*, grpc_closure*, absl::Status)>(
      "_ZN9grpc_core8Combiner3RunEP12grpc_closure" + absl_name("6StatusE").substr(2));
  __tsan_release(&received);
  run(this, closure, std::move(error));
}

class CallCombiner {
 public:
  void Start(grpc_closure* closure, absl::Status error, const char* file, int line, const char* why);
  void Stop(const char* file, int line, const char* why);
};

void CallCombiner::Start(grpc_closure* closure, absl::Status error, const char* file, int line,
                         const char* why) {
  static auto* const start =
      behind_this<void(CallCombiner*, grpc_closure*, absl::Status, const char*, int, const char*)>(
          "_ZN9grpc_core12CallCombiner5StartEP12grpc_closure" + absl_name("6StatusE").substr(2) + "PKciS7_");
  __tsan_release(&received);
  __tsan_release(this);
  __tsan_acquire(this);
  start(this, closure, std::move(error), file, line, why);
}

void CallCombiner::Stop(const char* file, int line, const char* why) {
  static auto* const stop = behind_this<void(CallCombiner*, const char*, int, const char*)>(
      "_ZN9grpc_core12CallCombiner4StopEPKciS2_");
  __tsan_release(this);
  __tsan_acquire(this);
  stop(this, file, line, why);
}

}  // namespace grpc_core

// The end of a call of the callback interface: OnDone is called once all its other call-backs have returned,
// which gRPC counts.
namespace grpc::internal {

namespace {

/// OnCancel of a reactor, before what is counted of it.
class CancelThenCount final : public ServerReactor {
 public:
  CancelThenCount(ServerReactor& reactor, void* count) : reactor_(reactor), count_(count) {}
  void OnCancel() override {
    reactor_.OnCancel();
    __tsan_release(count_);
    delete this;
  }
  void OnDone() override {}

 private:
  ServerReactor& reactor_;
  void* count_;
};

}  // namespace

void ServerCallbackCall::CallOnCancel(ServerReactor* reactor) {
  static auto* const call = behind_this<void(ServerCallbackCall*, ServerReactor*)>(
      "_ZN4grpc8internal18ServerCallbackCall12CallOnCancelEPNS0_13ServerReactorE");
  call(this, new CancelThenCount(*reactor, &callbacks_outstanding_));
}

void ServerCallbackCall::ScheduleOnDone(bool inlined) {
  static auto* const schedule =
      behind_this<void(ServerCallbackCall*, bool)>("_ZN4grpc8internal18ServerCallbackCall14ScheduleOnDoneEb");
  __tsan_acquire(&callbacks_outstanding_);
  schedule(this, inlined);
}

}  // namespace grpc::internal

// gRPC's locks: their atomics are not seen.
namespace absl {
ABSL_NAMESPACE_BEGIN

void Mutex::Lock() {
  static auto* const lock = behind_this<void(Mutex*)>(absl_name("5Mutex4LockEv"));
  lock(this);
  __tsan_acquire(this);
}

bool Mutex::TryLock() {
  static auto* const try_lock = behind_this<bool(Mutex*)>(absl_name("5Mutex7TryLockEv"));
  const bool locked = try_lock(this);
  if (locked) __tsan_acquire(this);
  return locked;
}

void Mutex::Unlock() {
  static auto* const unlock = behind_this<void(Mutex*)>(absl_name("5Mutex6UnlockEv"));
  __tsan_release(this);
  unlock(this);
}

void CondVar::Wait(Mutex* mutex) {
  static auto* const wait = behind_this<void(CondVar*, Mutex*)>(absl_name("7CondVar4WaitEPNS0_5MutexE"));
  __tsan_release(mutex);
  wait(this, mutex);
  __tsan_acquire(mutex);
}

bool CondVar::WaitWithTimeout(Mutex* mutex, Duration timeout) {
  static auto* const wait = behind_this<bool(CondVar*, Mutex*, Duration)>(
      absl_name("7CondVar15WaitWithTimeoutEPNS0_5MutexENS0_8DurationE"));
  __tsan_release(mutex);
  const bool is_over = wait(this, mutex, timeout);
  __tsan_acquire(mutex);
  return is_over;
}

bool CondVar::WaitWithDeadline(Mutex* mutex, Time deadline) {
  static auto* const wait = behind_this<bool(CondVar*, Mutex*, Time)>(
      absl_name("7CondVar16WaitWithDeadlineEPNS0_5MutexENS0_4TimeE"));
  __tsan_release(mutex);
  const bool is_over = wait(this, mutex, deadline);
  __tsan_acquire(mutex);
  return is_over;
}

ABSL_NAMESPACE_END
}  // namespace absl
