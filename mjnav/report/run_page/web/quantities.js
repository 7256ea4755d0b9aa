'use strict';

/* What is plotted over time: of one run every series, of several one series each. */

/** @returns {Array} the specifications that TimePlot takes */
function plotSpecs(runs) {
  const alone = runs.length === 1;
  const column = (run, name, i = 0) => (run.tables[name]?.width > i ? run.tables[name].column(i) : []);
  const pick = (title, unit, digits, series, more = {}) => ({
    title, unit, digits, ...more,
    series: runs.flatMap((run) => (alone ? series : series.slice(0, 1)).map(([label, style, values]) => ({
      run, values: values(run),
      label: alone ? label : `${run.letter} ${label}`,
      style: alone ? style : `run-${run.index}`,
    }))),
  });
  const share = (name, of) => (run) => column(run, name).map((ess) => (100 * ess) / run.particles[of]);
  const phase = (i) => (run) => column(run, 'phases', i);
  const whole = (run) => column(run, 'phases').map((_, frame) => run.row('phases', frame).reduce((a, b) => a + b, 0));
  const phases = runs[0].phases.map((name, i) => [name, `phase-${i}`, phase(i)]);
  return [
    pick('Clearance', 'm', 2, [['nearest surface', 'first', (run) => column(run, 'clearance')]]),
    pick('Speed v', 'm/s', 2, [
      ['actual', 'first', (run) => column(run, 'twist', 0)],
      ['command', 'second', (run) => column(run, 'command', 0)],
    ]),
    pick('Turn rate ω', 'rad/s', 2, [
      ['actual', 'first', (run) => column(run, 'twist', 1)],
      ['command', 'second', (run) => column(run, 'command', 1)],
    ]),
    pick('Cost of the chosen control', '', 3, [
      ['total', 'first', (run) => column(run, 'cost', 3)],
      ['goal', 'second', (run) => column(run, 'cost', 0)],
      ['obstacles, unweighted', 'third', (run) => column(run, 'cost', 1)],
      ['lanes, unweighted', 'fourth', (run) => (run.scene.lanes.length ? column(run, 'cost', 2) : [])],
    ], { asinh: true }),
    pick('Effective sample size', '% of the particles', 0, [
      ['robot', 'first', share('robot_ess', 'robot')],
      ['people, the least', 'third', share('people_ess', 'tracks')],
    ]),
    pick('Time of a tick', 'ms', 2, alone ? phases : [['', '', whole]], { stacked: alone }),
    pick('Lateness of a tick', 'ms', 3, [['behind its deadline', 'first', (run) => {
      const late = column(run, 'lateness');
      return late.some((value) => value > 0) ? late : [];
    }]]),
  ];
}
