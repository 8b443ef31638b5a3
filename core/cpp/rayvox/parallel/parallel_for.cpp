#include "rayvox/parallel/parallel_for.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdlib>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "rayvox/error.hpp"

namespace rayvox {
namespace {

constexpr int most_threads = 256;
// The parallel parts of one insertion follow each other within microseconds, and a thread that sleeps takes some fifty
// to wake: so threads look for more to do this long, giving way to others, before they sleep.
constexpr std::chrono::microseconds time_awake{100};

template <class Condition>
bool await(const Condition& holds) {
  for (const auto start = std::chrono::steady_clock::now(); std::chrono::steady_clock::now() - start < time_awake;) {
    if (holds()) return true;
    std::this_thread::yield();
  }
  return false;
}

thread_local int spared_threads = 0;

struct Job {
  Job(std::size_t n, const std::function<void(std::size_t, int)>& f, int most)
      : count(n), body(f), most_workers(most) {}

  std::size_t count;
  const std::function<void(std::size_t, int)>& body;
  int most_workers;
  std::atomic<std::size_t> next{0};
  std::atomic<int> workers{0};
  std::mutex mutex;
  std::condition_variable finished;
  std::atomic<int> running{0};
  std::exception_ptr error;

  void work() {
    const int worker = workers.fetch_add(1);
    if (worker >= most_workers) return;
    {
      std::lock_guard lock(mutex);
      if (next.load() >= count) return;
      ++running;
    }
    for (std::size_t index; (index = next.fetch_add(1)) < count;) {
      try {
        body(index, worker);
      } catch (...) {
        std::lock_guard lock(mutex);
        if (!error) error = std::current_exception();
        next.store(count);
      }
    }
    std::lock_guard lock(mutex);
    if (--running == 0) finished.notify_all();
  }
};

// Threads wait for jobs until the process ends. After a fork the child has none of them, so it makes its own pool.
class Pool {
 public:
  static Pool& of_this_process() {
    static std::mutex mutex;
    static Pool* pool = nullptr;
    std::lock_guard lock(mutex);
    if (!pool || pool->process_ != getpid()) pool = new Pool;
    return *pool;
  }

  void run(const std::shared_ptr<Job>& job) {
    const int helpers =
        static_cast<int>(std::min<std::size_t>(static_cast<std::size_t>(job->most_workers), job->count)) - 1;
    {
      std::lock_guard lock(mutex_);
      while (static_cast<int>(thread_count_) < helpers) {
        std::thread([this] { serve(); }).detach();
        ++thread_count_;
      }
      for (int i = 0; i < helpers; ++i) jobs_.push_back(job);
      job_count_.store(jobs_.size());
    }
    if (helpers > 0) wake_.notify_all();
    job->work();
    await([&] { return job->running.load() == 0; });
    std::unique_lock lock(job->mutex);
    job->finished.wait(lock, [&] { return job->running == 0; });
  }

 private:
  void serve() {
    for (;;) {
      std::shared_ptr<Job> job;
      await([&] { return job_count_.load() > 0; });
      {
        std::unique_lock lock(mutex_);
        wake_.wait(lock, [&] { return !jobs_.empty(); });
        job = std::move(jobs_.front());
        jobs_.pop_front();
        job_count_.store(jobs_.size());
      }
      job->work();
    }
  }

  const pid_t process_ = getpid();
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::shared_ptr<Job>> jobs_;
  std::atomic<std::size_t> job_count_{0};  // jobs_.size(), to be read without the lock
  int thread_count_ = 0;
};

int initial_thread_count() {
  const char* wanted = std::getenv("RAYVOX_THREADS");
  const int count = wanted ? std::atoi(wanted) : static_cast<int>(std::thread::hardware_concurrency());
  return std::clamp(count, 1, most_threads);
}

std::atomic<int>& configured_threads() {
  static std::atomic<int> count{initial_thread_count()};
  return count;
}

}  // namespace

int thread_count() { return std::max(1, configured_threads().load() - spared_threads); }

void spare_threads(int count) { spared_threads = std::clamp(count, 0, most_threads); }

void set_thread_count(int count) {
  if (count < 1 || count > most_threads) {
    throw InvalidInput("thread count must be from 1 to 256, got " + std::to_string(count));
  }
  configured_threads().store(count);
}

void parallel_for(std::size_t count, const std::function<void(std::size_t, int)>& body) {
  parallel_for(count, thread_count(), body);
}

void parallel_for(std::size_t count, int workers, const std::function<void(std::size_t, int)>& body) {
  if (workers == 1 || count < 2) {
    for (std::size_t index = 0; index < count; ++index) body(index, 0);
    return;
  }
  const auto job = std::make_shared<Job>(count, body, workers);
  Pool::of_this_process().run(job);
  if (job->error) std::rethrow_exception(job->error);
}

}  // namespace rayvox
