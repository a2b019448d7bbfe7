// Made by tests/tools/page_types.py from live/protocol.py and live/page_commands.py.

/** A recording that is shown; `end`: how it ended, `amendable`: its touches can get specimens. */
export interface ReviewedFile {
  name: string;
  rows: number;
  missing: number;
  refused: number;
  end: string;
  amendable: boolean;
}

/** A specimen on which the page can press, and its true modulus, MPa. */
export interface PressedSpecimen {
  name: string;
  modulus: number;
}

/** What a simulated hand presses on. */
export interface SimulatedPress {
  start_s: number;
  ratio: number;
  name: string;
}

/** What is known of a simulation; `specimens`: the page presses on them, empty: the hand presses by itself. */
export interface SimulationFacts {
  specimens: PressedSpecimen[];
  truths: SimulatedPress[];
}

/** What does not change during a measurement. */
export interface HelloMessage {
  type: "hello";
  measurement: number;
  kind: string;
  file: ReviewedFile | null;
  origin_s: number | null;
  seconds: number | null;
  source: string;
  simulation: SimulationFacts | null;
  device: string;
  scene: string;
  stated: string[];
  threshold: number | null;
  calibrated: boolean;
  scatter: number | null;
  assumed: number | null;
}

/** A recording that a page can open; `changed_s`: when it was written last, s since 1970. */
export interface ListedRecording {
  name: string;
  changed_s: number;
}

/** The newest recordings of the folder, the newest one first. */
export interface RecordingsMessage {
  type: "recordings";
  files: ListedRecording[];
}

/** A modulus with its 95 % interval. */
export interface ShownModulus {
  value_MPa: number | null;
  low_MPa: number | null;
  high_MPa: number | null;
  text: string;
  reason: string;
  extrapolated: boolean;
}

/** The recording that runs. */
export interface RunningRecording {
  name: string;
  rows: number;
  seconds: number | null;
}

/** The counts of `palpate.stream.StreamCounters`. */
export interface ShownCounters {
  read: number;
  lost: number;
  late: number;
  delivered: number;
  dropped: number;
  waiting: number;
  refused: number;
  saturated: number;
  recorded: number;
  unrecorded: number;
  errors: number;
  reconnects: number;
  retaken: number;
}

/** A file of this run. */
export interface RunFile {
  name: string;
  kind: string;
}

/** What to do now: Touch, Hold, Lift, Repeat, Stop, Tare, Wait or Ended; File: nothing is measured. */
export interface Instruction {
  word: string;
  sub: string;
  tone?: string;
  share?: number | null;
  reason?: string;
}

/** The status line. */
export interface ShownLine {
  level: string;
  title: string;
  text: string;
  since_s: number | null;
  what: string;
}

/** What changes all the time. */
export interface StateMessage {
  type: "state";
  state: string;
  end_s: number | null;
  ratio: number | null;
  standard_error: number | null;
  uncertainty: number | null;
  uncertainty_from: string;
  modulus: ShownModulus | null;
  recording: RunningRecording | null;
  counters?: ShownCounters;
  proposed: string;
  files: RunFile[];
  progress: string;
  comparable: number;
  now: Instruction;
  line: ShownLine;
  announce: string;
  on?: string | null;
}

/** A touch: its fields as in `palpate.Touch`, then what the session knows of it. */
export interface TouchRow {
  number: number;
  start: number;
  start_s: number | null;
  samples: number;
  ratio: number | null;
  covariance: number | null;
  standard_error: number | null;
  revised: boolean;
  first_ratio: number | null;
  first_standard_error: number | null;
  level_ratio: number | null;
  level_standard_error: number | null;
  contact_exponent: number | null;
  depth_pF: number | null;
  rise_s: number | null;
  age_s: number | null;
  ratio_before: number | null;
  before_standard_error: number | null;
  ratio_after: number | null;
  after_standard_error: number | null;
  offset_ratio: number | null;
  offset_standard_error: number | null;
  effects: { [name: string]: number | null };
  alarm_share: number | null;
  saturated: number;
  refused: number;
  flags: string[];
  outliers: number;
  end_s: number | null;
  modulus: ShownModulus | null;
  advice: string[];
  own_error: number | null;
  specimen: string | null;
  kept: boolean;
  why: string;
}

/** Relative scatter from touch to touch, and where it is from. */
export interface ShownScatter {
  share: number;
  source: string;
}

/** A trend over touches. */
export interface ShownTrend {
  change: number | null;
  probability: number | null;
}

/** Whether touches agree, as `palpate.Agreement`. */
export interface ShownAgreement {
  agree: boolean;
  ratio: number | null;
  standard_error: number | null;
  touches: number;
  spread: number | null;
  scatter: number | null;
  probability: number | null;
  cause: string | null;
  trend: ShownTrend | null;
  without_tilt: number | null;
  text: string;
  modulus?: ShownModulus | null;
}

/** The table of touches. `rows`: those that are new or have changed, of `count`. */
export interface TouchesMessage {
  type: "touches";
  rows: TouchRow[];
  scatter: ShownScatter;
  means: { [name: string]: number };
  most_reliable: number | null;
  together: ShownAgreement | null;
  count: number;
}

/** A mark. */
export interface ShownMark {
  id: number;
  t_s: number;
  text: string;
}

/** A place where pairs are missing. */
export interface ShownGap {
  from_s: number;
  to_s: number;
  lost: number;
  text: string;
}

/** What was judged of a channel. */
export interface ShownJudgement {
  t_s: number;
  channel: string;
  name: string;
  text: string;
}

/** A flag of a touch, and when it arose. */
export interface ShownFlag {
  t_s: number;
  touch: number;
  name: string;
  text: string;
}

/** What is marked on the axis of time. */
export interface EventsMessage {
  type: "events";
  marks: ShownMark[];
  tares: number[];
  gaps: ShownGap[];
  judgements: ShownJudgement[];
  flags: ShownFlag[];
}

/** How far a touch is from the mean of its specimen; `touch`: None, of an earlier measurement. */
export interface Deviation {
  touch: number | null;
  deviation: number | null;
  kept: boolean;
}

/** A specimen of the list; modulus in MPa, with its relative uncertainty. */
export interface SpecimenRow {
  name: string;
  modulus: number | null;
  uncertainty: number | null;
  kept: number;
  of: number;
  mean: number | null;
  deviations: Deviation[];
}

/** The specimen of the next touch. */
export interface NextTouch {
  name: string;
  modulus: number | null;
  nth: number;
  of: number;
}

/** How many of the wanted touches are done. */
export interface TouchCount {
  kept: number;
  of: number;
}

/** A note. */
export interface ShownNote {
  t_s: number;
  text: string;
}

/** The newest touch, and whether it is kept. */
export interface LastTouchKept {
  touch: number;
  kept: boolean;
}

/** The result of a session: its scatter, and how many known moduli are in their intervals. */
export interface SessionResult {
  scatter: number;
  source: string;
  inside: number;
  of: number;
  left_out: number;
}

/** The plan, and how much of it is done. */
export interface SessionMessage {
  type: "session";
  title: string;
  operator: string;
  wanted: number;
  specimens: SpecimenRow[];
  next: NextTouch | null;
  count: TouchCount;
  notes: ShownNote[];
  last: LastTouchKept | null;
  done: SessionResult | null;
}

/** A touch on a specimen of known modulus, beside the curve. */
export interface CalibrationPoint {
  modulus: number;
  specimen: string;
  fitted: number | null;
  touch: number;
  ratio: number | null;
  kept: boolean;
}

/** A parameter of eq. (2), in words. */
export interface ShownParameter {
  name: string;
  value: string;
  interval: string;
}

/** Points of the curve and of its confidence band. */
export interface ShownCurve {
  modulus: (number | null)[];
  ratio: (number | null)[];
  low: (number | null)[];
  high: (number | null)[];
}

/** The ratio on a rigid object. */
export interface RigidRatio {
  value: number | null;
  error: number | null;
}

/** The guided calibration; without a fit only the first fields. */
export interface CalibrationMessage {
  type: "calibration";
  on: boolean;
  saved?: string | null;
  next?: string;
  touches?: number;
  points?: CalibrationPoint[];
  verdict?: string;
  grade?: string;
  look?: number[];
  doubts?: string[];
  details?: string;
  sound?: boolean;
  parameters?: ShownParameter[];
  curve?: ShownCurve | null;
  rigid?: RigidRatio | null;
}

/** Whether the calibration holds on a known specimen; `text` is empty: there is no result. */
export interface VerificationMessage {
  type: "verification";
  text: string;
  agrees: boolean;
  kept: boolean;
}

/** A fact of the device; `share`: of a bar. */
export interface DeviceFact {
  name: string;
  value: string;
  warn?: boolean;
  share?: number | null;
  title?: string;
}

/** A setting of the converter. */
export interface DeviceOption {
  value: number | string;
  allowed: (number | string)[];
  title: string;
}

/** The device: its facts, and its settings by name. */
export interface DeviceMessage {
  type: "device";
  facts: DeviceFact[];
  options: { [name: string]: DeviceOption };
  can_centre: boolean;
}

/** How a line of a list is read: its modulus, MPa, with its relative uncertainty, or what is wrong. */
export interface ReadLine {
  modulus?: number | null;
  uncertainty?: number | null;
  wrong?: string;
}

/** A command was done: its name and the answer. */
export interface DoneMessage {
  type: "done";
  do: string;
  message: string;
  id?: number;
  file?: string;
  lines?: (ReadLine | null)[];
}

/** A recording that is compared. */
export interface ComparedFile {
  name: string;
  touches: number;
  kept: number;
}

/** A touch on a compared specimen. */
export interface ComparedTouch {
  file: number;
  number: number;
  ratio: number | null;
  left_out: string;
}

/** The touches on one specimen in all recordings; `apart`: how far the farthest recording is from the others. */
export interface ComparedSpecimen {
  name: string;
  farthest: number;
  apart: number | null;
  agreement: ShownAgreement | null;
  touches: ComparedTouch[];
}

/** The answer to compare. */
export interface ComparedMessage {
  type: "done";
  do: string;
  files: ComparedFile[];
  agree: number;
  of: number;
  scatter: number;
  specimens: ComparedSpecimen[];
  same: ComparedSpecimen | null;
}

/** A command was refused. */
export interface RefusedMessage {
  type: "refused";
  message: string;
}

/** Measure the baseline again. */
export interface TareCommand {
  do: "tare";
}

/** Measure the baseline again, also in contact. */
export interface TareAnywayCommand {
  do: "tare anyway";
}

/** Begin a recording; without a name: the proposed one. */
export interface RecordCommand {
  do: "record";
  name?: string | null;
}

/** End the recording. */
export interface StopCommand {
  do: "stop";
}

/** Begin the next measurement after one that has ended. */
export interface AgainCommand {
  do: "again";
}

/** Mark this moment. */
export interface MarkCommand {
  do: "mark";
}

/** Give a mark its text. */
export interface MarkTextCommand {
  do: "mark text";
  id: number;
  text: string;
}

/** Press the probe of the demo on a specimen, until it is released. */
export interface PressCommand {
  do: "press";
  specimen: string;
}

/** Lift the probe of the demo. */
export interface ReleaseCommand {
  do: "release";
}

/** Do not show again that the computer is slow. */
export interface UnderstoodCommand {
  do: "understood";
}

/** Set the range of the converter again. */
export interface CentreCommand {
  do: "centre";
}

/** Begin a new measurement with other settings of the converter. */
export interface DeviceCommand {
  do: "device";
  capf?: number;
  excitation?: string;
}

/** Take another list of specimens; without a title or an operator: those from before. */
export interface PlanCommand {
  do: "plan";
  text: string;
  wanted: number;
  unit?: string;
  title?: string | null;
  operator?: string | null;
}

/** Choose the specimen of the next touch; "": the list decides. */
export interface SpecimenCommand {
  do: "specimen";
  name: string;
}

/** Give a touch another specimen; "": none. */
export interface AssignCommand {
  do: "assign";
  touch: number;
  name: string;
}

/** Give touches a specimen, written as in a list; "": none. */
export interface NameCommand {
  do: "name";
  touches: number[];
  text: string;
}

/** Leave a touch out. */
export interface DiscardCommand {
  do: "discard";
  touch: number;
}

/** Keep a touch, whatever its flags are. */
export interface KeepCommand {
  do: "keep";
  touch: number;
}

/** Want one touch more of the specimen of the last touch, else of the next one. */
export interface MoreCommand {
  do: "more";
}

/** Add a note. */
export interface NoteCommand {
  do: "note";
  text: string;
}

/** Begin or end to calibrate. */
export interface CalibratingCommand {
  do: "calibrating";
  on: boolean;
}

/** Save the calibration, and a report of it. */
export interface SaveCalibrationCommand {
  do: "save calibration";
}

/** Add the result on a known specimen to the calibration file. */
export interface VerifyCommand {
  do: "verify";
}

/** Answer how each line of a list of specimens is read. */
export interface ReadListCommand {
  do: "read list";
  text: string;
  unit?: string;
}

/** Compare the recordings. */
export interface CompareCommand {
  do: "compare";
}

/** Estimate a part of a recording as a touch. */
export interface CutCommand {
  do: "cut";
  from_s: number;
  to_s: number;
}

/** Write a report of the newest recording. */
export interface ReportCommand {
  do: "report";
}

/** Stop the report that is being written. */
export interface StopReportCommand {
  do: "stop report";
}

/** Set the options of later reports. */
export interface SettingsCommand {
  do: "settings";
  unit?: string;
  shore?: boolean;
  probe?: string;
  site?: string;
  operator?: string;
}

/** Show another source: "measure", "demo", or the name of a listed recording. */
export interface OpenCommand {
  do: "open";
  what: string;
}

/** Answer the noise of the newest samples without contact. */
export interface NoiseCommand {
  do: "noise";
}

/** Send a view: the rows between two times in a frame with this number. */
export interface ViewCommand {
  do: "view";
  id: number;
  from_s: number;
  to_s: number;
  rows: number;
}

export type Message =
  | HelloMessage
  | RecordingsMessage
  | StateMessage
  | TouchesMessage
  | EventsMessage
  | SessionMessage
  | CalibrationMessage
  | VerificationMessage
  | DeviceMessage
  | DoneMessage
  | ComparedMessage
  | RefusedMessage;

export type Command =
  | TareCommand
  | TareAnywayCommand
  | RecordCommand
  | StopCommand
  | AgainCommand
  | MarkCommand
  | MarkTextCommand
  | PressCommand
  | ReleaseCommand
  | UnderstoodCommand
  | CentreCommand
  | DeviceCommand
  | PlanCommand
  | SpecimenCommand
  | AssignCommand
  | NameCommand
  | DiscardCommand
  | KeepCommand
  | MoreCommand
  | NoteCommand
  | CalibratingCommand
  | SaveCalibrationCommand
  | VerifyCommand
  | ReadListCommand
  | CompareCommand
  | CutCommand
  | ReportCommand
  | StopReportCommand
  | SettingsCommand
  | OpenCommand
  | NoiseCommand
  | ViewCommand;
