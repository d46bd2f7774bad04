-- The feed-forward of a pilot's sticks inside ArduSub, by seatrial. The table K above holds the vehicle.
-- The law is that of bridge/ardusub/law.py and bridge/vehicle/feedforward.py, and tests hold it to them.
-- It reads the mixer's output from the lower channels and overrides the thrusters' channels, for 50 ms at a time:
-- where this script stops, by whatever cause, the mixer's own output is back.

local TICK_MS, HOLD_MS, LET_GO_MS = 10, 50, 3
local OFF, SHADOW, ALONE, BOTH = 0, 1, 2, 3
local LATEST_S, PAUSE_S = 0.1, 0.5
local NAMES = {"surge", "sway", "yaw"}
local MASS, DAMPING, SQUARE = {"M_u", "M_v", "I_r"}, {"D_u", "D_v", "D_r"}, {"X_uu", "Y_vv", "N_rr"}
local WARNING, INFO = 4, 6

local function clip(value, low, high)
  return math.max(low, math.min(value, high))
end

local function say(text, severity)
  gcs:send_text(severity or WARNING, text)
end

-- Parameters. A set is staged by ordinary writes, and flies once FF_COMMIT holds its checksum.

assert(param:add_table(K.key, "FF_", 6), "seatrial: another script has its parameter table")
assert(param:add_table(K.key + 1, K.prefix, #K.params), "seatrial: another script has its parameter table")

local function own(key, prefix, index, name, default)
  assert(param:add_param(key, index, name, default), "seatrial: no parameter " .. prefix .. name)
  local made = Parameter()
  assert(made:init(prefix .. name), "seatrial: no parameter " .. prefix .. name)
  return made
end

local ff_mode = own(K.key, "FF_", 1, "MODE", OFF)
local ff_commit = own(K.key, "FF_", 2, "COMMIT", 0)
local ff_active = own(K.key, "FF_", 3, "ACTIVE", 0)
local ff_version = own(K.key, "FF_", 4, "VERSION", K.version)
local ff_hull = own(K.key, "FF_", 5, "HULL", 0)
local ff_applet = own(K.key, "FF_", 6, "APPLET", 0)
local staged = {}
for index, row in ipairs(K.params) do
  staged[index] = own(K.key + 1, K.prefix, index, row.name, row.default)
end

-- The wiring in which the mixer's output is back wherever this script stops. A crew may change it with the script there.
local outputs = {}
for _, row in ipairs(K.factors) do
  for _, number in ipairs({row.motor, K.first_output + row.motor - 1}) do
    local name, made = "SERVO" .. number .. "_FUNCTION", Parameter()
    assert(made:init(name), "seatrial: no parameter " .. name)
    outputs[#outputs + 1] = {name = name, of = made, wanted = 32 + row.motor}
  end
end

local function miswired()
  for _, output in ipairs(outputs) do
    local is = output.of:get()
    if is ~= output.wanted then return string.format("%s is %g, not %d", output.name, is, output.wanted) end
  end
end

local mode, active, active_crc = OFF, nil, 0
local coefficients = {}

-- CRC-32, four bits at a time; the low 24 bits name a set, as in bridge/vehicle/parameters.py.
local NIBBLE = {}
for n = 0, 15 do
  local c = n
  for _ = 1, 4 do
    c = (c & 1 ~= 0) and (((c >> 1) & 0x7FFFFFFF) ~ 0xEDB88320) or (c >> 1)
  end
  NIBBLE[n] = c & 0xFFFFFFFF
end

local function crc_over(crc, bytes)
  for at = 1, #bytes do
    local byte = bytes:byte(at)
    crc = ((crc >> 4) & 0x0FFFFFFF) ~ NIBBLE[(crc ~ byte) & 15]
    crc = ((crc >> 4) & 0x0FFFFFFF) ~ NIBBLE[(crc ~ (byte >> 4)) & 15]
  end
  return crc
end

-- A scan reads the staged set a few parameters a tick: a whole set would take a tick too long.
local scan

local function begin_scan(done)
  scan = {at = 0, crc = 0xFFFFFFFF, values = {}, done = done}
end

local function go_on()
  for _ = 1, 4 do
    scan.at = scan.at + 1
    local index = K.order[scan.at]
    if not index then
      local crc = (scan.crc ~ 0xFFFFFFFF) & 0xFFFFFF
      local finished = scan
      scan = nil
      finished.done(crc == 0 and 1 or crc, finished.values)
      return
    end
    local value = staged[index]:get() + 0.0
    scan.values[index] = value
    scan.crc = crc_over(scan.crc, K.prefix .. K.params[index].name .. "=" .. string.pack("<f", value))
  end
end

-- The value that must be kept by a write of its own; a write by anybody else is undone.
local function keep(parameter, value)
  if parameter:get() ~= value then
    parameter:set_and_save(value)
  end
end

-- Vehicle.

local function thrust_of(pwm)
  local t = K.table
  if not t then
    local o = clip((pwm - 1500) / K.span_us, -1.0, 1.0)
    return math.abs(pwm - 1500) <= K.dead_us and 0.0 or K.most_n * o * math.abs(o)
  end
  if pwm <= t.us[1] then return t.n[1] end
  if pwm >= t.us[#t.us] then return t.n[#t.n] end
  local low, high = 1, #t.us
  while high - low > 1 do
    local middle = (low + high) // 2
    if t.us[middle] <= pwm then low = middle else high = middle end
  end
  return t.n[low] + (pwm - t.us[low]) * (t.n[high] - t.n[low]) / (t.us[high] - t.us[low])
end

-- The pulse for a thrust beyond the dead zone, between the points first (its edge) and last of the table.
local function between(t, first, last, wanted)
  if math.abs(wanted) >= math.abs(t.n[last]) then return t.us[last] end
  local low, high = first, last
  while math.abs(high - low) > 1 do
    local middle = (low + high) // 2
    if math.abs(t.n[middle]) <= math.abs(wanted) then low = middle else high = middle end
  end
  return t.us[low] + (wanted - t.n[low]) * (t.us[high] - t.us[low]) / (t.n[high] - t.n[low])
end

local function curve_pwm(wanted)
  if wanted == 0 then return 1500.0 end
  local t = K.table
  if not t then
    local share = clip(wanted / K.most_n, -1.0, 1.0)
    return 1500 + K.span_us * (share < 0 and -math.sqrt(-share) or math.sqrt(share))
  end
  if wanted > 0 then return between(t, t.ahead, #t.us, wanted) end
  return between(t, t.astern, 1, wanted)
end

local slope_ahead = (curve_pwm(K.least_n) - 1500) / K.least_n
local slope_astern = (1500 - curve_pwm(-K.least_n)) / K.least_n

local function pwm_of(wanted)
  if math.abs(wanted) < K.least_n then
    return 1500 + wanted * (wanted > 0 and slope_ahead or slope_astern)
  end
  return curve_pwm(wanted)
end

local function wrench_of(thrusts)
  local wrench = {0.0, 0.0, 0.0}
  for axis = 1, 3 do
    for n = 1, #thrusts do
      wrench[axis] = wrench[axis] + K.matrix[axis][n] * thrusts[n]
    end
  end
  return wrench
end

-- The wrench of the sticks: the mixer's inputs (3), 1 in full, to outputs; beyond 1 scaled down together, or cut off.
local function stick_wrench(inputs)
  local outputs, largest = {}, 1.0
  for n, row in ipairs(K.factors) do
    outputs[n] = row[1] * inputs[1] + row[2] * inputs[2] + row[3] * inputs[3]
    largest = math.max(largest, math.abs(outputs[n]))
  end
  local scale = K.scales_together and largest or 1.0
  for n = 1, #outputs do
    outputs[n] = thrust_of(1500 + 400 * clip(outputs[n] / scale, -1.0, 1.0))
  end
  return wrench_of(outputs)
end

-- The law.

local nu, nu_dot = {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}
local before, fed, integral = nil, {0.0, 0.0, 0.0}, {0.0, 0.0}
local share = 0.0

local function hull_wrench(u, v, r, du, dv, dr)
  local c = coefficients
  local function give(name) return c[name] or 0.0 end
  local ahead, aside = give("S_x"), give("S_y")
  local x = give("X_uu") * math.abs(u) * u - ahead * r * r - aside * dr
  local y = give("Y_vv") * math.abs(v) * v + give("Y_r") * r + give("Y_uv") * math.abs(u) * v
  y = y + ahead * dr - aside * r * r
  local n = give("N_rr") * math.abs(r) * r + give("N_v") * v
  n = n + give("N_uv") * math.abs(u) * v + give("N_munk") * u * v
  n = n + ahead * (dv + u * r) - aside * (du - v * r)
  return {x, y, n}
end

-- Whether an axis has what the law needs.
local function lacks(axis)
  if not coefficients[MASS[axis]] then return MASS[axis] end
  if not (coefficients[DAMPING[axis]] or coefficients[SQUARE[axis]]) then return DAMPING[axis] end
end

local function feedforward(v, v_dot, bound)
  local more = hull_wrench(v[1], v[2], v[3], v_dot[1], v_dot[2], v_dot[3])
  local tau = {0.0, 0.0, 0.0}
  for axis = 1, 3 do
    if not lacks(axis) then
      local force = coefficients[MASS[axis]] * v_dot[axis] + (coefficients[DAMPING[axis]] or 0.0) * v[axis]
      force = force + more[axis]
      tau[axis] = bound and clip(force, -K.reach[axis], K.reach[axis]) or force
    end
  end
  return tau
end

local function steady(force, linear, quadratic)
  local size, speed = math.abs(force), 0.0
  if quadratic > 0 then
    speed = (math.sqrt(linear * linear + 4 * quadratic * size) - linear) / (2 * quadratic)
  elseif linear > 0 then
    speed = size / linear
  end
  speed = math.min(speed, K.fastest)
  return force < 0 and -speed or speed
end

local function follow(pilot, flown, dt)
  local within = math.min(dt, LATEST_S)
  for axis = 1, 3 do
    local target = 0.0
    if axis <= flown then
      local c = coefficients
      target = steady(pilot[axis], c[DAMPING[axis]] or 0.0, c[SQUARE[axis]] or 0.0)
    end
    local pull = K.pace ^ 2 * (target - nu[axis]) - 2 * K.pace * nu_dot[axis]
    nu_dot[axis] = nu_dot[axis] + within * pull / (1 + 2 * K.pace * within)
    nu[axis] = nu[axis] + within * nu_dot[axis]
  end
end

-- The velocity hold of BOTH in surge and sway, by gains that go with the speed of the reference. It holds to the
-- reference as it will be, for so does the vehicle: its lead makes up for what the sticks' way takes. With stick and
-- reference at rest it remembers nothing, and a velocity far off the reference is not held: it may be wrong, or the
-- vehicle snagged.
local astray = {false, false}

local function hold(measured, off, pilot, dt)
  local force = {0.0, 0.0}
  if mode ~= BOTH or not measured or dt <= 0 then
    integral, astray = {0.0, 0.0}, {false, false}
    return force
  end
  local ahead = {nu[1] + K.ahead_s * nu_dot[1], nu[2] + K.ahead_s * nu_dot[2]}
  local speed, speeds = math.sqrt(ahead[1] ^ 2 + ahead[2] ^ 2), K.speeds
  local right = 1
  while right < #speeds and speeds[right] <= speed do right = right + 1 end
  local left = math.max(right - 1, 1)
  local weight = right == left and 0.0 or clip((speed - speeds[left]) / (speeds[right] - speeds[left]), 0.0, 1.0)
  for axis = 1, 2 do
    local wrong, reach = ahead[axis] - measured[axis], K.hold_share * K.reach[axis]
    local far = not off[axis] and math.abs(wrong) > K.held_within_m_s
    if far and not astray[axis] then
      say(string.format("FF %s not held: velocity off by over %g m/s", NAMES[axis], K.held_within_m_s))
    end
    astray[axis] = far
    if off[axis] or far then
      integral[axis] = 0.0
    else
      if math.abs(pilot[axis]) < K.at_rest_n and math.abs(ahead[axis]) < K.at_rest_m_s then integral[axis] = 0.0 end
      local kp = K.mass_kg * ((1 - weight) * K.kp[axis][left] + weight * K.kp[axis][right])
      local ki = K.mass_kg * ((1 - weight) * K.ki[axis][left] + weight * K.ki[axis][right])
      local bound, was = K.integral_share * reach, integral[axis]
      local now = clip(was + ki * wrong * dt, -bound, bound)
      if math.abs(now) > math.abs(was) and math.abs(kp * wrong + now) > reach then now = was end
      integral[axis] = now
      force[axis] = clip(kp * wrong + now, -reach, reach)
    end
  end
  return force
end

-- Shadow: does the model explain the force that the thrusters gave? (bridge/vehicle/shadow.py)

local blocks, block, last_nu = {}, nil, nil

local function pause_shadow()
  block, last_nu = nil, nil
end

local function forget_shadow()
  blocks = {}
  pause_shadow()
end

local function new_block()
  return {s = 0.0, given = {0.0, 0.0, 0.0}, predicted = {0.0, 0.0, 0.0}, fed = {0.0, 0.0, 0.0}}
end

local function judge(dt, given, tau, measured)
  local was = last_nu
  last_nu = measured
  if not was then
    block = new_block()
    return
  end
  local change = {}
  for axis = 1, 3 do change[axis] = (measured[axis] - was[axis]) / dt end
  local predicted = feedforward(measured, change, false)
  block.s = block.s + dt
  for axis = 1, 3 do
    block.given[axis] = block.given[axis] + given[axis] * dt
    block.predicted[axis] = block.predicted[axis] + predicted[axis] * dt
    block.fed[axis] = block.fed[axis] + math.abs(tau[axis]) * dt
  end
  if block.s >= K.block_s - 0.5 * dt then
    blocks[#blocks + 1] = block
    if #blocks > K.window then table.remove(blocks, 1) end
    block = new_block()
  end
end

local function unproven()
  if #blocks == 0 and not last_nu then return "shadow: none flown, seatrial ff shadow first" end
  if #blocks < K.window then
    return string.format("shadow: %d of %d s flown", math.floor(K.block_s * #blocks), math.floor(K.block_s * K.window))
  end
  local worst, named
  for axis = 1, 3 do
    local moved, left, whole = 0.0, 0.0, 0.0
    for _, b in ipairs(blocks) do
      if b.fed[axis] >= K.moved_share * K.reach[axis] * b.s then moved = moved + K.block_s end
      left = left + (b.given[axis] - b.predicted[axis]) ^ 2
      whole = whole + b.given[axis] ^ 2
    end
    if moved >= K.moved_s then
      local explained = whole > 0 and 1 - left / whole or -1.0
      if not worst or explained < worst then worst, named = explained, NAMES[axis] end
    end
  end
  if not worst then return string.format("shadow: no axis moved for %d s", math.floor(K.moved_s)) end
  if worst >= K.explained then return nil end
  return string.format("shadow: %d %% of %s explained", math.floor(100 * math.max(worst, 0.0)), named)
end

-- Proof, disarmed, before anything is added: does an override end by itself? A firmware that never lets go of one
-- would leave a thruster at its last pulse where this script stops. The first mirror, which drives nothing, is overridden
-- by a pulse that no thruster turns at, and must be the mixer's again afterwards.

local PROOF_US, PROOF_TICKS = 1503, 20
local proof = {tick = 0, ends = nil}

local function prove()
  if proof.ends ~= nil then return end
  if arming:is_armed() or miswired() then
    proof.tick = 0
    return
  end
  local motor = K.factors[1].motor
  local seen = SRV_Channels:get_output_pwm(32 + motor)
  if proof.tick == 0 then
    -- A mirror that a script before this one has left overridden proves it too.
    if seen == PROOF_US then proof.ends = false end
    SRV_Channels:set_output_pwm_chan_timeout(motor - 1, PROOF_US, HOLD_MS)
  elseif proof.tick == 1 and seen ~= PROOF_US then
    -- Not this output, or not yet: once more.
    proof.tick = -1
  elseif proof.tick >= PROOF_TICKS then
    proof.ends = seen ~= PROOF_US
  end
  proof.tick = proof.tick + 1
  if proof.ends == false then say("no applet: this firmware keeps overrides for ever") end
end

-- Orders.

local function take_set(values)
  active = values
  coefficients = {}
  for index, row in ipairs(K.params) do
    if values[index] ~= 0 then coefficients[row.coefficient] = values[index] end
  end
  forget_shadow()
  for axis = 1, 3 do
    local name = lacks(axis)
    if name then say("FF " .. NAMES[axis] .. " off: " .. name .. " is missing") end
  end
end

local function out_of_bounds(values)
  for index, row in ipairs(K.params) do
    local value = values[index]
    if value ~= value or (value ~= 0 and (value < row.low or value > row.high)) then return K.prefix .. row.name end
  end
end

local function commit(wanted)
  begin_scan(function(crc, values)
    local fault = out_of_bounds(values)
    if crc ~= wanted then
      say("FF_COMMIT refused: CRC is not the staged set's")
    elseif fault then
      say("FF_COMMIT refused: " .. fault .. " out of bounds")
    elseif arming:is_armed() and mode >= ALONE then
      say("FF_COMMIT refused: armed, force FF off first")
    else
      take_set(values)
      active_crc = crc
      ff_hull:set_and_save(K.hull)
      ff_active:set_and_save(crc)
      say(string.format("F5:%d FF set %d active", crc, crc), INFO)
    end
    ff_commit:set_and_save(active_crc)
  end)
end

local LEFT_TO_IT = {[OFF] = 0, [SHADOW] = 0, [BOTH] = 1, [ALONE] = 2}

local function order(wanted)
  local why
  if not LEFT_TO_IT[wanted] then
    why = string.format("FF_MODE refused: %g is no mode", wanted)
  elseif wanted >= ALONE and proof.ends == false then
    why = "FF_MODE refused: outputs would freeze"
  elseif wanted >= ALONE and miswired() then
    why = "FF_MODE refused: " .. miswired()
  elseif wanted >= ALONE and not active then
    why = "F1 FF_MODE refused: no active set"
  elseif arming:is_armed() and LEFT_TO_IT[wanted] > LEFT_TO_IT[mode] then
    local lacking = unproven()
    if lacking then
      say("F2 FF_MODE refused: armed, shadow not good yet")
      why = "F3 " .. lacking
    end
  end
  if why then
    say(why)
    ff_mode:set_and_save(mode)
  else
    mode = wanted
    ff_mode:set_and_save(mode)
  end
end

-- Every tick.

local last_us, due_us, watch_us, latest = micros(), nil, nil, 0.0
local overrides = false

local function let_go(mirror)
  if overrides then
    for n, row in ipairs(K.factors) do
      SRV_Channels:set_output_pwm_chan_timeout(K.first_output + row.motor - 2, mirror[n], LET_GO_MS)
    end
    overrides = false
  end
end

local function rest()
  nu, nu_dot, before = {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}, nil
  fed, integral, share = {0.0, 0.0, 0.0}, {0.0, 0.0}, 0.0
end

local function measured_now()
  local earth = ahrs:get_velocity_NED()
  if not earth then return nil end
  local body, gyro = ahrs:earth_to_body(earth), ahrs:get_gyro()
  local u, v, r = body:x(), body:y(), gyro:z()
  if u ~= u or v ~= v or r ~= r then return nil end
  return {u, v, r}
end

-- The inputs as the mixer has them. The channels are looked up once: rc:get_pwm waits for the main loop, at times for
-- longer than an override lasts.
local channels = {}
for axis, number in ipairs(K.channels) do
  channels[axis] = assert(rc:get_channel(number), "seatrial: no input channel " .. number)
end

local function sticks()
  return {channels[1]:norm_input(), channels[2]:norm_input(), channels[3]:norm_input()}
end

local function fly(dt)
  local mirror, thrusts = {}, {}
  for n, row in ipairs(K.factors) do
    mirror[n] = SRV_Channels:get_output_pwm(32 + row.motor)
    -- Without its mirror nothing is known of a motor: what was overridden ends by itself.
    if not mirror[n] then return end
    thrusts[n] = thrust_of(mirror[n])
  end
  local flown = K.flown[vehicle:get_mode()]
  if mode == OFF or not (proof.ends and active and flown and arming:is_armed()) then
    let_go(mirror)
    rest()
    if mode >= ALONE and arming:is_armed() then pause_shadow() else forget_shadow() end
    return
  end
  local pilot, off = stick_wrench(sticks()), {}
  for axis = 1, 3 do off[axis] = axis > flown or lacks(axis) ~= nil end
  follow(pilot, flown, dt)
  local tau = feedforward(nu, nu_dot, true)
  -- It waits for the filter, which ALONE need not.
  local measured = mode ~= ALONE and measured_now() or nil
  local held = hold(measured, off, pilot, dt)
  local most, step, added, changed = 0.0, K.slope_per_s * math.min(dt, LATEST_S), {0.0, 0.0, 0.0}, false
  before = before or tau
  share = mode >= ALONE and math.min(share + step, 1.0) or 0.0
  for axis = 1, 3 do
    local reach = K.reach[axis]
    most = K.lead_share * reach
    local led = tau[axis]
    if dt > 0 then led = led + clip(K.lead_s / dt * (tau[axis] - before[axis]), -most, most) end
    if off[axis] then
      fed[axis] = 0.0
    else
      local wanted = clip(led + (held[axis] or 0.0), -reach, reach)
      fed[axis] = clip(wanted, fed[axis] - step * reach, fed[axis] + step * reach)
      added[axis] = share * clip(fed[axis] - pilot[axis], -K.most_added * reach, K.most_added * reach)
      changed = changed or added[axis] ~= 0
    end
  end
  before = tau
  if changed then
    for n, row in ipairs(K.factors) do
      local base, wanted = thrusts[n], thrusts[n]
      for axis = 1, 3 do wanted = wanted + K.inverse[n][axis] * added[axis] end
      wanted = clip(wanted, math.min(base, -K.limit_n), math.max(base, K.limit_n))
      local pwm = math.floor(clip(pwm_of(wanted), 1100, 1900) + 0.5)
      SRV_Channels:set_output_pwm_chan_timeout(K.first_output + row.motor - 2, pwm, HOLD_MS)
      thrusts[n] = thrust_of(pwm)
    end
    overrides = true
  else
    let_go(mirror)
  end
  if mode ~= SHADOW then
    pause_shadow()
  elseif not measured then
    forget_shadow()
  elseif dt > 0 then
    judge(dt, wrench_of(thrusts), tau, measured)
  end
end

local function since(us)
  return us and (micros() - us):tofloat() * 1e-6 or math.huge
end

local function update()
  local now = micros()
  local dt = (now - last_us):tofloat() * 1e-6
  last_us = now
  latest = math.max(latest, dt)
  if dt > PAUSE_S then
    rest()
    dt = 0.0
  end
  local wanted = ff_mode:get()
  -- Off first: whatever else waits, it acts in this tick.
  if wanted ~= mode then order(wanted) end
  prove()
  if proof.ends == false and mode >= ALONE then order(OFF) end
  local fault = mode >= ALONE and miswired()
  if fault then
    say("FF off: " .. fault)
    order(OFF)
  end
  fly(dt)
  if scan then
    go_on()
  elseif ff_commit:get() ~= active_crc then
    commit(ff_commit:get())
  elseif since(watch_us) > 0.2 then
    watch_us = now
    keep(ff_active, active_crc)
    keep(ff_version, K.version)
    keep(ff_applet, K.applet)
  end
  if since(due_us) > 0.5 then
    due_us = now
    gcs:send_named_float("FF_MODE", mode)
    if proof.ends ~= nil then gcs:send_named_float("FF_ENDS", proof.ends and 1 or 0) end
    gcs:send_named_float("FF_REF_U", nu[1])
    gcs:send_named_float("FF_REF_V", nu[2])
    gcs:send_named_float("FF_TICK_MS", 1000 * latest)
    latest = 0.0
  end
  return update, TICK_MS
end

-- The start: a set flies again if it is whole, and was committed on this hull.
local function come_up()
  if scan then go_on() end
  if scan then return come_up, TICK_MS end
  return update, TICK_MS
end

begin_scan(function(crc, values)
  local stored = ff_mode:get()
  local whole = ff_active:get() == crc and ff_hull:get() == K.hull and not out_of_bounds(values)
  if whole then
    take_set(values)
    active_crc = crc
    mode = LEFT_TO_IT[stored] and stored or OFF
    if mode >= ALONE then say("FF acts once armed") end
  elseif ff_active:get() ~= 0 then
    say("FF: no set is in force, upload one")
  end
  keep(ff_mode, mode)
  keep(ff_commit, active_crc)
  keep(ff_active, active_crc)
  keep(ff_applet, K.applet)
end)

return come_up, TICK_MS
