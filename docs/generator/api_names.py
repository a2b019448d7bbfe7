"""The public names of the Python package: the page and the group of each."""

from docs.generator.python_pages import ApiPage

API = ApiPage(
    "api.md",
    "Python API",
    """\
Units: capacitances in pF, moduli in MPa, times in seconds as `float` or in nanoseconds as `int`.
A name says its unit: `period_s`, `hard_pF`. `output` and `regressor` are the changes of the hard
and the soft capacitance, without the baseline; `hard` and `soft` are the readings, with the
baseline.

An argument out of range raises `ValueError` with the argument, the value and the allowed range.
`import palpate` loads the compiled core only. numpy is loaded with the first array, and an
optional package when it is needed: `palpate.errors.MissingExtra` says which one to install.

More names: [touches](api_touches.md), [recordings](api_recordings.md), [sources and
streams](api_sources.md), [the AD7746](api_ad7746.md), [calibration](api_calibration.md),
[simulation](api_simulation.md), [numpy reference](api_numpy.md).""",
    {
        "Touches": [
            "palpate.touches",
            "palpate.advice",
            "palpate.offline",
            "palpate.agreement",
            "palpate.most_reliable",
            "palpate.Tracker",
            "palpate.Touch",
            "palpate.Judgement",
            "palpate.Uncertainty",
        ],
        "Estimators": [
            "palpate.HandoverRls",
            "palpate.AdaptiveRls",
            "palpate.VectorRls",
            "palpate.Rls",
            "palpate.HandoverRls32",
            "palpate.AdaptiveRls32",
            "palpate.Rls32",
            "palpate.Bank",
        ],
        "Recordings": [
            "palpate.read",
            "palpate.recorded",
            "palpate.Recording",
            "palpate.check",
        ],
        "Sources and streams": [
            "palpate.open",
            "palpate.Source",
            "palpate.Sample",
            "palpate.Status",
            "palpate.Stream",
            "palpate.SampleRing",
        ],
        "Calibration": [
            "palpate.Calibration",
        ],
        "Folders for a C++ build": [
            "palpate.get_include",
            "palpate.get_cmake_dir",
        ],
        "Errors": [
            "palpate.PalpateError",
            "palpate.errors.SourceError",
            "palpate.errors.DeviceNotFound",
            "palpate.errors.DeviceRefused",
            "palpate.errors.SourceTimeout",
            "palpate.errors.ProtocolError",
            "palpate.errors.RecordingError",
            "palpate.errors.SomeFailed",
            "palpate.errors.CalibrationError",
            "palpate.errors.CalibrationRefused",
            "palpate.errors.MissingExtra",
        ],
    },
)
API_TOUCHES = ApiPage(
    "api_touches.md",
    "Python API: touches",
    "What a touch has besides [the main names](api.md).",
    {
        "Flags and judgements": [
            "palpate.flags.Flag",
            "palpate.flags.Advice",
            "palpate.judgements.judgement_notes",
        ],
        "Results": [
            "palpate.uncertainty.Scatter",
            "palpate.offline_touches.OfflineTouch",
            "palpate.touch_readings.stiffening.Stiffening",
        ],
    },
)
API_RECORDINGS = ApiPage(
    "api_recordings.md",
    "Python API: recordings",
    "What reads, writes and checks recordings besides [the main names](api.md).",
    {
        "Recordings": [
            "palpate.recording_protocol.RecordingProtocol",
            "palpate.recording_protocol.ArrayRecording",
            "palpate.recording_protocol.Part",
            "palpate.recording.session.Plan",
            "palpate.recording.opened.OpenedRecording",
            "palpate.recording.csv_reader.RecordingFile",
            "palpate.recording.reading.ImportedRecording",
            "palpate.recording.recorder.Recorder",
            "palpate.recording.verification.Verification",
            "palpate.recording.sidecar.Sidecar",
            "palpate.recording.counts.Survey",
            "palpate.recording.convert.convert",
        ],
    },
)
API_SOURCES = ApiPage(
    "api_sources.md",
    "Python API: sources and streams",
    """\
For [sources of your own](../sources.md), and for programs that follow a measurement. [The main
names](api.md) are on another page.""",
    {
        "Sources": [
            "palpate.sources.schemes",
            "palpate.sources.devices.devices",
            "palpate.sources.ListedDevice",
            "palpate.sources.SampleSource",
            "palpate.sources.Gap",
            "palpate.sources.GapCause",
            "palpate.sources.TroubleBegan",
            "palpate.sources.TroubleEnded",
            "palpate.sources.TroubleKind",
            "palpate.sources.Conditions",
        ],
        "Streams": [
            "palpate.stream.batches.Estimate",
            "palpate.stream.batches.Batch",
            "palpate.stream.counters.StreamCounters",
            "palpate.stream.listeners.Listener",
            "palpate.stream.lsl_outlets.Outlets",
        ],
        "Options and test of a source": [
            "palpate.sources.conformance.check_source",
            "palpate.sources.options.Options",
            "palpate.sources.options.option",
            "palpate.sources.options.number",
            "palpate.sources.options.whole_number",
            "palpate.sources.options.choice",
            "palpate.sources.options.text",
            "palpate.sources.options.yes_no",
        ],
    },
)
API_AD7746 = ApiPage(
    "api_ad7746.md",
    "Python API: the AD7746",
    "The driver of the converter, its two buses, and its registers.",
    {
        "Driver": [
            "palpate.ad7746.driver.Ad7746",
            "palpate.ad7746.configuration.Configuration",
            "palpate.ad7746.configuration.Channel",
            "palpate.ad7746.evalkit.usb_bus.EvalKit",
            "palpate.ad7746.i2c.I2cBus",
        ],
        "Registers": [
            "palpate.ad7746.registers.capacitance_pF",
            "palpate.ad7746.registers.capacitance_code",
            "palpate.ad7746.registers.is_saturated",
            "palpate.ad7746.registers.temperature_C",
            "palpate.ad7746.registers.dac_registers",
            "palpate.ad7746.registers.check_write",
        ],
    },
)
API_CALIBRATION = ApiPage(
    "api_calibration.md",
    "Python API: calibration",
    """\
Parts and results of [`palpate.Calibration`](api.md#palpatecalibration), and the elasticity of
specimens.""",
    {
        "Calibration": [
            "palpate.calibration.modulus.UncertaintyPart",
            "palpate.calibration.Modulus",
            "palpate.calibration.specimen_fit.fit_specimens",
            "palpate.calibration.specimen_fit.SpecimenTouches",
            "palpate.calibration.specimen_fit.combined_ratio",
            "palpate.calibration.specimen_fit.CombinedRatio",
            "palpate.calibration.assurance.CalibrationVerification",
            "palpate.calibration.selection.choose_ratio",
            "palpate.calibration.selection.Track",
            "palpate.calibration.selection.RatioChoice",
            "palpate.calibration.fit.CurveFit",
            "palpate.calibration.assessment.Residual",
        ],
        "Elasticity and materials": [
            "palpate.elasticity.Elasticity",
            "palpate.materials.modulus_of_shore_a",
            "palpate.materials.shore_a_of_modulus",
            "palpate.materials.KnownModulus",
        ],
    },
)
API_SIMULATION = ApiPage(
    "api_simulation.md",
    "Python API: simulation and design",
    """\
[The simulation](../simulation.md) explains the parts of a scenario, [Two
signals](../two_signals.md) the design of a detector.""",
    {
        "Simulation": [
            "palpate.simulation.scenarios.run",
            "palpate.simulation.probe.simulate",
            "palpate.simulation.probe.Scenario",
            "palpate.simulation.hand.session",
            "palpate.simulation.hand.Hand",
            "palpate.simulation.mechanics.Substrate",
            "palpate.simulation.mechanics.Bumps",
            "palpate.simulation.mechanics.Gauge",
            "palpate.simulation.press.Tilt",
            "palpate.simulation.signals.Peaks",
            "palpate.simulation.signals.Lines",
            "palpate.simulation.readings.BaselineModel",
            "palpate.simulation.readings.ConverterModel",
            "palpate.simulation.readings.Stamps",
            "palpate.simulation.readings.Faults",
            "palpate.simulation.press.Press",
            "palpate.simulation.probe.Simulation",
        ],
        "Design of a detector": [
            "palpate.design.cusum",
            "palpate.design.run_length",
            "palpate.design.Cusum",
        ],
    },
)
API_NUMPY = ApiPage(
    "api_numpy.md",
    "Python API: reference in numpy",
    """\
The estimators and the stages of the scene `handheld` again, slow and equation by equation.
`handheld` is the whole scene.""",
    {
        "Reference": [
            "palpate.reference.rls",
            "palpate.reference.adaptive_rls",
            "palpate.reference.adaptive_window",
            "palpate.reference.vector_rls",
            "palpate.reference.screen",
            "palpate.reference.matched_pair",
            "palpate.reference.Baseline",
            "palpate.reference.Contact",
            "palpate.reference.Levels",
            "palpate.reference.Fit",
            "palpate.reference.handheld",
            "palpate.reference.sliding",
            "palpate.reference.stiffening.stiffening",
            "palpate.reference.Trace",
            "palpate.reference.AdaptiveWindowTrace",
            "palpate.reference.VectorTrace",
            "palpate.reference.Screened",
            "palpate.reference.Pairs",
            "palpate.reference.Judgement",
            "palpate.reference.Misfit",
            "palpate.reference.Touch",
            "palpate.reference.Rows",
        ],
    },
)
PAGES = [
    API,
    API_TOUCHES,
    API_RECORDINGS,
    API_SOURCES,
    API_AD7746,
    API_CALIBRATION,
    API_SIMULATION,
    API_NUMPY,
]
