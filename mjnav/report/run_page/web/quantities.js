'use strict';

/* What is plotted over time: of one run every series, of several one series each. */

/** @returns {Array} the specifications that TimePlot takes */
function plotSpecs(runs) {
  const alone = runs.length === 1;
  const column = (run, name, i = 0) => (run.tables[name]?.width > i ? run.tables[name].column(i) : []);
  const plot = (title, unit, digits, help, series, more = {}) => ({
    title, unit, digits, help, ...more,
    series: runs.flatMap((run) => (alone ? series : series.slice(0, 1)).map(([label, style, values]) => ({
      run, values: values(run),
      label: alone ? label : `${run.letter} ${label}`,
      style: alone ? style : `run-${run.index}`,
    }))),
  });
  const share = (i) => (run) => column(run, 'ess', i).map((ess) => 100 * ess);
  const spread = runs.flatMap((run) => run.events.filter(({ name }) => name === 'recovery')
    .map(({ time, text }) => ({ time: time - run.time[0], text: alone ? text : `${run.letter} ${text}` })));
  const phase = (i) => (run) => column(run, 'phases', i);
  const whole = (run) => column(run, 'phases').map((_, frame) => run.row('phases', frame).reduce((a, b) => a + b, 0));
  const phases = runs[0].phases.map((name, i) => [name, `phase-${i}`, phase(i)]);
  const late = (run) => (column(run, 'lateness').some((value) => value > 0) ? column(run, 'lateness') : []);
  const both = 'true, and as commanded to the motors';
  return [
    plot('Clearance', 'm', 2, "distance of the robot's surface from the nearest one", [
      ['nearest surface', 'first', (run) => column(run, 'clearance')],
    ]),
    plot('Speed v', 'm/s', 2, `along the robot's heading: ${both}`, [
      ['actual', 'first', (run) => column(run, 'twist', 0)],
      ['command', 'second', (run) => column(run, 'command', 0)],
    ]),
    plot('Turn rate ω', 'rad/s', 2, `counter-clockwise positive: ${both}`, [
      ['actual', 'first', (run) => column(run, 'twist', 1)],
      ['command', 'second', (run) => column(run, 'command', 1)],
    ]),
    plot('Cost of the chosen control', '', 3, 'what the method minimises, in its own units; parts before their weights', [
      ['total', 'first', (run) => column(run, 'cost', 3)],
      ['goal', 'second', (run) => column(run, 'cost', 0)],
      ['obstacles, unweighted', 'third', (run) => column(run, 'cost', 1)],
      ['lanes, unweighted', 'fourth', (run) => (run.scene.lanes.length ? column(run, 'cost', 2) : [])],
    ], { asinh: true }),
    plot('Error against uncertainty', 'NEES over its 95 % bound', 2, 'error, squared, by the inverse of the covariance that '
      + 'the belief claims, over the bound that 95 % of errors keep: above 1 the truth is outside of the 95 % region. '
      + 'Triangles: a filter was spread again', [
      ['robot', 'first', (run) => column(run, 'nees', 0)],
      ['people, the largest', 'third', (run) => column(run, 'nees', 1)],
    ], { asinh: true, level: 1, marks: spread }),
    plot('Effective sample size', '% of the particles', 0, '(Σ w)² / Σ w² over the weights w of the particles. '
      + 'Triangles: a filter was spread again', [
      ['robot', 'first', share(0)],
      ['people, the least', 'third', share(1)],
    ], { marks: spread }),
    plot('Time of a tick', 'ms', 2, 'wall time of the phases of a tick',
      alone ? phases : [['', '', whole]], { stacked: alone }),
    plot('Lateness of a tick', 'ms', 3, 'wall time from the deadline of a paced tick to its begin',
      [['behind its deadline', 'first', late]]),
  ];
}
