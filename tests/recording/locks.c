// SPDX-License-Identifier: MIT
// What Windows does with the calls of palpate.recording.windows_lock. Usage: locks.exe PLACE [child]
#include <fcntl.h>
#include <io.h>
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>

static unsigned long long place;

static OVERLAPPED at(void) {
  OVERLAPPED found = {0};
  found.Offset = (DWORD)place;
  found.OffsetHigh = (DWORD)(place >> 32);
  return found;
}

static void say(const char* what, int value) {
  printf("%s=%d\n", what, value);
  fflush(stdout);
}

static void lock(const char* what, int file, DWORD flags) {
  OVERLAPPED here = at();
  const HANDLE handle = (HANDLE)_get_osfhandle(file);
  say(what, LockFileEx(handle, flags | LOCKFILE_FAIL_IMMEDIATELY, 0, 1, 0, &here) ? 0 : (int)GetLastError());
}

static void unlock(int file) {
  OVERLAPPED here = at();
  say("unlock", UnlockFileEx((HANDLE)_get_osfhandle(file), 0, 1, 0, &here) ? 0 : (int)GetLastError());
}

int main(int count, char** arguments) {
  const char* const name = "locked.csv";
  char bytes[8];
  place = strtoull(arguments[1], NULL, 10);
  if (count > 2) {  // until it is killed
    OVERLAPPED here = at();
    LockFileEx((HANDLE)_get_osfhandle(_open(name, _O_RDWR)), LOCKFILE_EXCLUSIVE_LOCK, 0, 1, 0, &here);
    fclose(fopen("ready", "w"));
    Sleep(INFINITE);
  }
  say("size", (int)sizeof(OVERLAPPED));
  const int writer = _open(name, _O_RDWR | _O_CREAT | _O_EXCL | _O_BINARY | _O_APPEND, 0666);
  const int reader = _open(name, _O_RDONLY | _O_BINARY), other = _open(name, _O_RDWR | _O_BINARY);
  lock("exclusive", writer, LOCKFILE_EXCLUSIVE_LOCK);
  say("write", _write(writer, "12345", 5));
  say("read", _read(reader, bytes, 5));
  lock("shared", reader, 0);
  lock("second", other, LOCKFILE_EXCLUSIVE_LOCK);
  fclose(fopen("new", "w"));
  say("replace", MoveFileExA("new", name, MOVEFILE_REPLACE_EXISTING) ? 0 : (int)GetLastError());
  unlock(writer);
  lock("shared", reader, 0);
  lock("shared", other, 0);
  lock("exclusive", writer, LOCKFILE_EXCLUSIVE_LOCK);
  unlock(reader);
  unlock(other);

  STARTUPINFOA startup = {sizeof startup};
  PROCESS_INFORMATION child;
  char command[1024];
  snprintf(command, sizeof command, "\"%s\" %s child", arguments[0], arguments[1]);
  if (!CreateProcessA(NULL, command, NULL, NULL, FALSE, 0, NULL, NULL, &startup, &child)) {
    return 1;
  }
  for (int i = 0; i < 1000 && _access("ready", 0) != 0; ++i) {
    Sleep(20);
  }
  lock("process", reader, 0);
  TerminateProcess(child.hProcess, 1);
  WaitForSingleObject(child.hProcess, INFINITE);
  lock("killed", reader, 0);
  return 0;
}
