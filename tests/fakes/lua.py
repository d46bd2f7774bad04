"""ArduSub's Lua, as far as an applet uses it, on the package lupa: the same words, on a fake autopilot's state."""

import pytest

_WORDS = """
local host = ...
local U = {}
U.__index = U
U.__sub = function(a, b) return setmetatable({v = (a.v - b.v) & 0xFFFFFFFF}, U) end
function U:tofloat() return self.v + 0.0 end
local V = {}
V.__index = V
function V:x() return self[1] end
function V:y() return self[2] end
function V:z() return self[3] end
local function vector(x, y, z) return setmetatable({x, y, z}, V) end
local P = {}
P.__index = P
function P:init(name)
  self.name = name
  return host.known(name)
end
function P:get() return host.get(self.name) end
function P:set_and_save(value)
  host.set(self.name, value)
  return true
end
local E = {math = math, string = string, table = table, assert = assert, ipairs = ipairs, pairs = pairs}
E.Parameter = function() return setmetatable({}, P) end
E.param = {
  add_table = function(_, key, prefix, count) return host.add_table(key, prefix, count) end,
  add_param = function(_, key, index, name, default) return host.add_param(key, index, name, default) end,
}
E.micros = function() return setmetatable({v = host.micros()}, U) end
E.gcs = {
  send_text = function(_, severity, text) host.text(severity, text) end,
  send_named_float = function(_, name, value) host.named(name, value) end,
}
E.arming = {is_armed = function() return host.armed() end}
E.vehicle = {get_mode = function() return host.mode() end}
local C = {}
C.__index = C
function C:norm_input() return (host.rc(self.number) - 1500) / 400 end
E.rc = {get_channel = function(_, number) return setmetatable({number = number}, C) end}
E.ahrs = {
  get_velocity_NED = function()
    if host.has_velocity() then return vector(host.velocity(1), host.velocity(2), host.velocity(3)) end
  end,
  earth_to_body = function(_, v) return v end,
  get_gyro = function() return vector(0.0, 0.0, host.turn()) end,
}
E.SRV_Channels = {
  get_output_pwm = function(_, motor) return host.pwm(motor) end,
  set_output_pwm_chan_timeout = function(_, channel, pwm, ms)
    assert(math.type(pwm) == "integer" and pwm >= 0, "bad argument pwm")
    host.override(channel, pwm, ms)
  end,
}
return function(text)
  local chunk, why = load(text, "script", "t", E)
  if not chunk then error(why) end
  return chunk
end
"""


class Script:
    """A script that runs: `due_s` is when it is called next, None once it has stopped; `error` why it did.

    `host` has the methods that `_WORDS` asks for.
    """

    def __init__(self, text, host, now_s):
        lua53 = pytest.importorskip("lupa.lua53", reason="the Lua of applets needs the package lupa")
        self.lua = lua53.LuaRuntime(unpack_returned_tuples=True)
        self.error, self.due_s = "", now_s
        self._lua_error = lua53.LuaError
        self._next = self.lua.execute(_WORDS, host)(text)

    def step(self, now_s):
        """Run what is due; a script that fails is stopped, as ArduSub does."""
        if self.due_s is None or now_s < self.due_s - 1e-9:
            return
        try:
            answer = self._next()
        except self._lua_error as error:
            self.error, answer = str(error), None
        if isinstance(answer, tuple):
            self._next, ms = answer
            self.due_s = now_s + ms * 1e-3
        else:
            self.due_s = None

    def stop(self):
        self.due_s = None
